"""The page that simulates: one file of HTML with programs as WebAssembly, controls, plots; nothing is fetched."""
