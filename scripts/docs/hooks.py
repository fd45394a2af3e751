"""Hooks of mkdocs: links out of docs/ lead to files of the repository, which the site does not hold. Their text stays, with the file's path as a hint; a file that
does not exist is a warning, which --strict makes an error."""
import logging
import os
import pathlib
import posixpath
import re

LOG = logging.getLogger("mkdocs.hooks.repository")
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LINK = re.compile(r"(?<!!)\[([^\]\[]+)\]\((\.\./[^)\s#]*)(#[^)\s]*)?\)")
CODE = re.compile(r"(^```.*?^```|`[^`\n]*`)", re.MULTILINE | re.DOTALL)


def on_page_markdown(markdown, page, config, files):
    folder = posixpath.dirname("docs/" + page.file.src_uri)

    def replace(match):
        target = posixpath.normpath(posixpath.join(folder, match.group(2)))
        if target.startswith("docs/"):
            return match.group(0)
        if not os.path.exists(ROOT / target):
            LOG.warning("'%s' links to '%s', which is not in the repository", page.file.src_uri, target)
        return '<span class="source" title="%s" markdown="span">%s</span>' % (target, match.group(1))

    # Links in code are text. (A link's own text may hold code: those are matched first.)
    parts, end = [], 0
    for code in CODE.finditer(markdown):
        inside = [link for link in LINK.finditer(markdown) if link.start() <= code.start() and code.end() <= link.end()]
        if inside:
            continue
        parts += [LINK.sub(replace, markdown[end:code.start()]), code.group(0)]
        end = code.end()
    return "".join(parts + [LINK.sub(replace, markdown[end:])])
