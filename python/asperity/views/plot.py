"""Pictures of results, with matplotlib: histories, energies, an overview; fields of snapshots.

Colour-blind readers can distinguish the colours. Axes have units with SI prefixes (mm, MPa). The
sizes of new figures and of their text suit the columns of a journal.
"""

from .plot_fields import plot_field, plot_section
from .plot_history import plot_history
from .plot_overview import plot_overview
from .style import COLOURS, si_scale

__all__ = ["COLOURS", "plot_field", "plot_history", "plot_overview", "plot_section", "si_scale"]
