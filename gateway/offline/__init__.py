"""The same pipeline without clock or network: logs in, batches and estimates out."""
