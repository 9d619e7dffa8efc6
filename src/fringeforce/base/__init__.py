"""Array types, errors, progress, optional libraries, child processes, and files written whole."""
