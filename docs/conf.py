"""What Sphinx is told. `make site` puts the pages together and builds them (scripts/website.py)."""

from ppafo.version import __version__

project = "ppafo"
author = "The ppafo developers"
release = version = __version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.viewcode", "scripts.docstrings"]
root_doc = "index"

# Pages: Markdown as a forge shows it, with its mathematics; every heading can be linked to. Blocks without a
# language are plain text.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
html_math_renderer = "mathml"
highlight_language = "text"

# The tutorial is run each time, and what it prints to the error stream (progress) is left out.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_in_temp = True
nb_output_stderr = "remove"
nb_merge_streams = True

# The interface, in the order of the source and with its types as they are written there.
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autosummary_generate = False
add_module_names = False
python_use_unqualified_type_names = True
python_display_short_literal_types = True
python_maximum_signature_line_length = 100

# Every reference must lead somewhere, but for types in signatures: those of other packages and inner ones have no page.
nitpicky = True
nitpick_ignore_regex = [("py:(class|obj|data|exc|attr)", r".*")]
# A type that is imported for annotations alone is looked up by its short name, which two classes may have.
suppress_warnings = ["ref.python"]

# One folder that is opened without a server and asks no other host for anything. Search results have no
# extracts, because a page from a file may not read another one.
html_theme = "furo"
html_title = "ppafo"
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False
html_show_copyright = False
html_domain_indices = False
