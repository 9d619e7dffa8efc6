"""Where readings go: files, a browser, robots."""
