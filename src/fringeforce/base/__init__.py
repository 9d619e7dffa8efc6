"""Errors, progress, optional libraries, child processes, and files written whole or not at all."""
