"""Reading and writing: documents, units, expressions, model files. Units exist only in here."""
