"""Interactive page: one HTML file with WebAssembly programs, controls and plots, without network access."""
