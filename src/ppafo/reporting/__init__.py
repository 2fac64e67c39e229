"""Results for people: figures, tables and pages."""
