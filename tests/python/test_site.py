"""The site in a real browser, opened from its folder: no page logs an error or asks the network; the search finds."""

from pathlib import Path

import pytest
from chromium import needs_chromium
from playwright.sync_api import expect

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "out/site"


def is_of_these_pages() -> bool:
    """Whether the site was built, and no file of its pages is newer; what they quote from code is not looked at."""
    index = SITE / "index.html"
    pages = [ROOT / "mkdocs.yml", *(ROOT / "docs").rglob("*.*"), *(ROOT / "benchmarks").glob("*.md")]
    return index.exists() and index.stat().st_mtime >= max(page.stat().st_mtime for page in pages)


if not is_of_these_pages():
    pytest.skip("needs the site as it is now: `make test-docs` builds it and runs this", allow_module_level=True)

pytestmark = [
    needs_chromium,
    pytest.mark.timeout(180),
]


@pytest.fixture
def page(browser):
    """A page that remembers what went wrong in it."""
    page = browser.new_page()
    page.wrong = []
    page.on("console", lambda message: message.type == "error" and page.wrong.append(message.text))
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("request", lambda request: request.url.startswith("http") and page.wrong.append(request.url))
    yield page
    page.close()


def test_no_page_logs_an_error_or_asks_the_network(page):
    # A web server shows 404.html, from the top of its own address.
    files = sorted(file for file in SITE.rglob("*.html") if file.name != "404.html")
    for file in files:
        page.goto(file.as_uri())
        assert page.wrong == [], file
    assert len(files) > 30


def test_the_search_finds_from_a_folder(page):
    page.goto((SITE / "agents/index.html").as_uri())
    page.keyboard.press("s")
    page.locator("input[name=query]").press_sequentially("boustrophedon")
    expect(page.locator(".md-search-result__link").first).to_be_visible(timeout=30_000)
    page.locator(".md-search-result__link").first.click()
    expect(page.locator("h1")).to_be_visible()
    assert page.wrong == []


def test_formulas_are_drawn_as_formulas(page):
    page.goto((SITE / "agents/jump.html").as_uri())
    fraction = page.locator("math[display=block] mfrac").first
    over, under = fraction.locator("> *").nth(0).bounding_box(), fraction.locator("> *").nth(1).bounding_box()
    assert over["y"] + over["height"] <= under["y"] + 1


def test_a_wide_table_is_scrolled_by_itself_and_keeps_its_first_column(page):
    page.set_viewport_size({"width": 800, "height": 700})
    page.goto((SITE / "figures/league.html").as_uri())
    wide = page.locator(".md-typeset__scrollwrap").nth(2)
    first, last = wide.locator("tbody td").first, wide.locator("thead th").last
    assert last.bounding_box()["x"] > 800
    wide.evaluate("table => { table.scrollLeft = table.scrollWidth; }")
    assert last.bounding_box()["x"] + last.bounding_box()["width"] <= 800
    assert first.bounding_box()["x"] >= 0
    assert page.evaluate("document.documentElement.scrollWidth") <= 800


def test_data_that_a_page_links_to_is_on_the_site(page):
    page.goto((SITE / "figures/league.html").as_uri())
    link = page.get_by_role("link", name="LEAGUE.csv").get_attribute("href")
    assert (SITE / "figures" / link).read_text(encoding="utf-8").startswith("part,cell,agent")
