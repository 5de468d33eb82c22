"""Contact of a viscoelastic solid with a rough, rigid surface."""
