"""The sections of a report, each from the contents to blocks and figures."""
