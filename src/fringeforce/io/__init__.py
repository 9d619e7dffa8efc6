"""Frames, forces and fields in files: HDF5, CSV, VTK."""
