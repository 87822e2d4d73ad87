"""Reading and writing: documents, units, expressions, model files. Units are used only here."""
