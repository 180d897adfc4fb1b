# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Configuration of Sphinx for scripts/site, which copies the documents and these files together."""
import ast
import pathlib
import re

import risley

project = "risley"
author = "The risley authors"
copyright = "2026 The risley authors"
release = risley.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["docs/site"]
default_role = "py:obj"

myst_heading_anchors = 4
# Code in the documents is C++, YAML and what a terminal shows.
highlight_language = "none"

autodoc_default_options = {
    "members": True, "inherited-members": "object, tuple, BaseException, OSError",
    "show-inheritance": True}
autodoc_class_signature = "separated"
napoleon_google_docstring = False
napoleon_use_ivar = True

html_theme = "alabaster"
html_theme_options = {"description": "Risley-prism lidars", "page_width": "1200px", "sidebar_width": "260px"}
html_sidebars = {"**": ["about.html", "searchbox.html", "navigation.html"]}
html_copy_source = False

FOLDER_LINK = re.compile(r"(\]\((?!\w+:)[^)#\s]*/?)\)")
ANCHOR = re.compile(r"<a id=\"([^\"]+)\"></a>")
ANCHOR_LINK = re.compile(r"\[([^\]]+)\]\(([^)#:\s]*)#([^)\s]+)\)")


def stated_signatures():
    """What the stubs state of methods in C++: "Sensor.sigma" to ("(name: str)", "Optional[float]")."""
    stubs = (pathlib.Path(risley.__file__).parent / "_risley.pyi").read_text("utf-8")
    signatures = {}
    for owner in ast.parse(stubs).body:
        for function in getattr(owner, "body", ()):
            if isinstance(function, ast.FunctionDef):
                arguments = re.sub(r"^(self|cls)(, )?", "", ast.unparse(function.args))
                signatures[f"{owner.name}.{function.name}"] = (f"({arguments})",
                                                               ast.unparse(function.returns))
    return signatures


SIGNATURES = stated_signatures()


def mend_links(app, document, source):
    """Two kinds of links that other readers of Markdown follow.

    One to a folder, which is a list of files elsewhere, leads to the page about the folder; one to
    an anchor that is written by hand is written by hand as well.
    """
    folder = pathlib.Path(app.srcdir, document).parent

    def folder_page(link):
        target = link.group(1).partition("](")[2]
        return f"{link.group(1)}/README.md)" if (folder / target).is_dir() else link.group(0)

    def anchor(link):
        words, page, name = link.groups()
        text = (folder / page).read_text("utf-8") if page else source[0]
        if name not in ANCHOR.findall(text):
            return link.group(0)
        return f"<a href=\"{re.sub('md$', 'html', page)}#{name}\">{words}</a>"

    source[0] = ANCHOR_LINK.sub(anchor, FOLDER_LINK.sub(folder_page, source[0]))


def take_signature(app, what, name, obj, options, signature, result):
    """The signature of a method in C++, which does not show it."""
    return SIGNATURES.get(name.partition(".")[2]) if what == "method" else None


def leave_out(app, what, name, obj, skip, options):
    """Fields of named tuples stand in the text of their class."""
    return True if type(obj).__name__ == "_tuplegetter" else None


def require_everything(app, error):
    """Fails where a public name of the package is not in the reference."""
    if error is None:
        missing = {f"risley.{name}" for name in risley.__all__}
        missing -= set(app.env.get_domain("py").objects)
        if missing:
            raise ValueError(f"reference.rst lacks {', '.join(sorted(missing))}")


def setup(app):
    app.connect("source-read", mend_links)
    app.connect("autodoc-process-signature", take_signature)
    app.connect("autodoc-skip-member", leave_out)
    app.connect("build-finished", require_everything)
