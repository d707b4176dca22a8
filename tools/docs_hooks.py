"""Hooks of the documentation's site.

What a page links to outside of docs/ is shown as a path, and notebooks are pages.
"""

from __future__ import annotations

import json
import posixpath
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

sys.path.insert(0, str(Path(__file__).parent))
from notebooks import as_markdown

LINK = re.compile(r'\[([^\]]*)\]\(((?:\.\./)+[^)#\s]+)(#[^)\s]*)?\)')


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """See mkdocs: the text of a page before it is rendered."""
    folder = posixpath.dirname(page.file.src_uri)

    def replaced(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join('docs', folder, match[2]))
        inside = target.startswith('docs/')
        return match[0] if inside else f'{match[1]} (`{target}`)'

    return LINK.sub(replaced, markdown)


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """See mkdocs: a page NAME.md for each NAME.ipynb."""
    for each in [file for file in files if file.src_uri.endswith('.ipynb')]:
        page = as_markdown(json.loads(each.content_string))
        path = each.src_uri.removesuffix('.ipynb') + '.md'
        files.append(File.generated(config, path, content=page))
    return files
