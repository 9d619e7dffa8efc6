"""The example of the paper, step by step, as figures, statements and one page."""
