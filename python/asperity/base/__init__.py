"""What all rooms use: checks of arguments, calls of the Fortran library, names, tables, errors."""
