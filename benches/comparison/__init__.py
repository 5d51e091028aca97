"""One surface, the same loads, several codes: what `peers.py` is made of."""
