"""What all subpackages use: checks, calls of the Fortran library, names, tables, errors."""
