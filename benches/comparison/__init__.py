"""Parts of `peers.py`, which runs several codes on one surface and the same loads."""
