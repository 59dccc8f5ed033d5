"""What `import lambent` offers: the commands as functions and objects.

Public are the names in `lambent.__all__`, their methods and properties without an underscore, and what these return.
Everything below `lambent.*` is the implementation and may change.
"""
