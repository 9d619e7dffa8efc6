"""Where lines come from: files, the simulator, GenICam cameras."""
