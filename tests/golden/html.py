"""A page as a reader of HTML sees it."""

import base64
import re
from html.parser import HTMLParser


class Page(HTMLParser):
    """The tags with their attributes, the words, and the scripts within the page."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words = ""
        self.scripts = re.findall(r"<script>(.*?)</script>", content, flags=re.DOTALL)
        self.feed(content)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.words += data

    def images(self, kind: str = "") -> list[bytes]:
        sources = [attributes["src"] or "" for tag, attributes in self.tags if tag == "img"]
        assert all(source.startswith("data:image/") for source in sources)
        return [base64.b64decode(s.partition(",")[2]) for s in sources if s.startswith(f"data:image/{kind}")]
