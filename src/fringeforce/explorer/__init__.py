"""See and feel a sensor in a browser: a page on this machine, and the server behind it."""
