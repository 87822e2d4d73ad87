"""One generic leg in vectors, a table of what differs, and the sum."""
