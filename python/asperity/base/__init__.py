"""Tools of all rooms: checks of arguments, calls of the Fortran library, names, tables, errors."""
