"""Bodies that press on a pad, and the forces that its tactels then carry."""
