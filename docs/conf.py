"""How Sphinx builds the site (`make site`), without network: no inventories and no scripts from elsewhere."""

from __future__ import annotations

import os
import shutil
import sys
from importlib.metadata import version as installed
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]
shutil.rmtree(HERE / "generated", ignore_errors=True)  # an example that is gone would leave its page
os.environ.setdefault("OMP_NUM_THREADS", "1")  # examples are small: threads only cost

project = "hdsim"
author = "The hdsim developers"
copyright = "the hdsim developers, BSD-3-Clause"
version = release = installed("hdsim")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "pages",
    "scenario_fields",
]
exclude_patterns = ["README.md", "gallery", "images", "_ext", "generated/**/*.ipynb", "generated/**/*.py"]

# Pages are written for GitHub, whose headings have anchors, and which shows `$` as it is.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"  # tests/tasks/test_notebook.py runs the notebook

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config, model_post_init, model_computed_fields"}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Class attributes", "params_style"), ("Args of the kernel", "params_style")]
copybutton_exclude = ".linenos, .gp, .go"

sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["generated/gallery"],
    "filename_pattern": r".*\.py",
    "within_subsection_order": "FileNameSortKey",
    "copyfile_regex": "",
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "abort_on_example_error": True,
    "plot_gallery": True,
    "matplotlib_animations": False,
    "min_reported_time": 1e9,  # how long an example took changes with the machine
    "write_computation_times": False,
}

smartquotes = False  # a prime of an equation is no quotation mark
html_theme = "furo"
html_title = "hdsim"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
