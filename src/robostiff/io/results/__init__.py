"""Results as text, as plain data for JSON, and as files of MATLAB."""
