"""Page that simulates: one HTML file with the C of scenarios as WebAssembly, and their numbers as sliders."""
