"""Phase from intensity: critical points, folding, and the search along the strip."""
