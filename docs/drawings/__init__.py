"""The drawings of the documents, each a module with one function that gives its SVG."""
