"""The composed module of a program in other languages: a typed walk over its text, and emitters of what that finds."""
