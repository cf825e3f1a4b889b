"""Sphinx extension that writes formulas as MathML, which browsers draw without a script or a font.

Docutils translates the LaTeX. A numbered formula shows its label, `$$ … $$ (7)`, so that the text
of a page refers to it in the same way here and where the Markdown is read as it is.
"""

from html import escape
from typing import TYPE_CHECKING

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

WARNINGS = logging.getLogger(__name__)


def setup(app: "Sphinx") -> dict[str, bool]:
    """Draw inline and displayed formulas with MathML."""
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def inline(translator: "HTML5Translator", node: nodes.math) -> None:
    """A formula in a line."""
    translator.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def displayed(translator: "HTML5Translator", node: nodes.math_block) -> None:
    """A formula of its own, with its number."""
    number = f'<span class="eqno">({node["label"]})</span>' if node.get("label") else ""
    opened = translator.starttag(node, "div", CLASS="math")
    translator.body.append(f"{opened}{number}{mathml(node, as_block=True)}</div>\n")
    raise nodes.SkipNode


def mathml(node: nodes.math | nodes.math_block, as_block: bool) -> str:
    """The formula of a node; LaTeX that docutils does not know is a warning, and shown as it is."""
    try:
        return tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        WARNINGS.warning("formula %r: %s", node.astext(), error, location=node)
        return f"<code>{escape(node.astext())}</code>"
