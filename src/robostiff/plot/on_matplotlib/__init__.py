"""Pictures drawn with Matplotlib, for paper."""
