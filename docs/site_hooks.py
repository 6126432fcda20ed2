"""What `make docs` does to a page before it becomes one of the site; mkdocs.yml names this file."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"(?<!!)\[([^][]+)\]\((\.\./[^)#\s]+)(#[^)\s]*)?\)")


def on_page_markdown(markdown, page, config, files):
    """Links to files of the repository that are no pages become their names: the site stands alone."""
    folder = Path(page.file.abs_src_path).parent

    def outside(link):
        target = (folder / link[2]).resolve()
        if target.is_relative_to(config["docs_dir"]) or not target.exists():
            return link[0]   # mkdocs tells of what is not there
        name = target.relative_to(ROOT)
        return f"`{name}`" if link[1].strip("`") in str(name) else f"{link[1]} (`{name}`)"

    return LINK.sub(outside, markdown)


def on_post_page(output, page, config):
    """The script that lets the search work without a server lies in the site, not in the network."""
    return output.replace("https://unpkg.com/iframe-worker/shim", "../" * page.url.count("/") + "scripts/iframe_worker.js")
