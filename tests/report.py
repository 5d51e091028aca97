"""Tests pages of `asperity report` in a browser: light and dark, wide and narrow, and on paper.

    python3 tests/report.py data/results/quickstart/report.html [more pages] [--pictures FOLDER]

It needs Debian's packages chromium and chromium-driver, and selenium.
"""

import argparse
import base64
import re
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.interaction import POINTER_TOUCH
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

WIDE, PHONE = (1200, 900), (390, 844)

# Lowest contrast of visible text with its background, by WCAG 2, and this text.
CONTRAST = """
const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
const luminance = ([r, g, b]) => [r, g, b].map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
const ground = (element) => {
    for (let at = element; at; at = at.parentElement) {
        const colour = parts(getComputedStyle(at).backgroundColor);
        if (colour.length === 3 || colour[3] > 0) return colour;
    }
    return [255, 255, 255];
};
let lowest = [Infinity, ""];
for (const element of document.querySelectorAll("body *")) {
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !element.getClientRects().length || element.closest("script")) continue;
    const style = getComputedStyle(element);
    const text = element instanceof SVGElement ? style.fill : style.color;
    const [high, low] = [luminance(parts(text)), luminance(ground(element))].sort((a, b) => b - a);
    const contrast = (high + 0.05) / (low + 0.05);
    if (contrast < lowest[0]) lowest = [contrast, element.textContent.trim().slice(0, 40)];
}
return lowest;
"""

# Names of empty figures: without size, without axes and map, or with points that are not numbers.
UNDRAWN = """
return [...document.querySelectorAll("figure .panel")].filter((panel) => {
    const svg = panel.querySelector("svg");
    const box = svg?.getBoundingClientRect();
    const marks = svg?.querySelectorAll(".series path, .series polyline, .series circle, image, .series polygon").length;
    return !box || box.width < 180 || box.height < 100 || !marks || /="[^"]*\\bNaN\\b/.test(svg.outerHTML.replace(/data:[^"]*/g, ""));
}).map((panel) => panel.closest("figure").id);
"""

# Charts whose data are at one place only.
ONE_PLACE = """
return [...document.querySelectorAll("figure .chart")].filter((chart) => {
    const all = [...chart.querySelectorAll("[data-points]")].flatMap((group) => group.dataset.points.split(" "));
    const places = new Set(all.map((point) => point.split(",")[0]));
    return places.size < 2;
}).map((chart) => chart.closest("figure").id);
"""

# Height in pixels of the smallest visible text beside subscripts, and this text.
SMALLEST = """
let smallest = [Infinity, ""];
for (const element of document.querySelectorAll("body *")) {
    const own = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !element.getClientRects().length || element.closest("script, style, sub, tspan[font-size], details:not([open]) > :not(summary)")) continue;
    const matrix = element instanceof SVGElement ? element.getScreenCTM() : null;
    const scale = matrix ? Math.hypot(matrix.c, matrix.d) : 1;
    const size = scale * parseFloat(getComputedStyle(element).fontSize);
    if (size < smallest[0]) smallest = [size, element.textContent.trim().slice(0, 40)];
}
return smallest;
"""

# Visible text of the page without code, for texts that were not formatted.
TEXT = """
const copy = document.body.cloneNode(true);
copy.querySelectorAll("pre, code, script, style").forEach((part) => part.remove());
return copy.textContent;
"""

# Pairs of overlapping words in one drawing.
OVERLAPS = """
const pairs = [];
for (const svg of document.querySelectorAll("figure .panel svg")) {
    const words = [...svg.querySelectorAll("text")].map((t) => [t.textContent, t.getBoundingClientRect()]);
    words.forEach(([one, a], i) => words.slice(i + 1).forEach(([other, b]) => {
        const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        // Boxes of texts hold the descents of their subscripts, which lie at the side of turned texts.
        const [x, y] = a.height > a.width ? [4, 1] : [1, 3];
        if (across > x && down > y) pairs.push(`${svg.closest("figure").id}: ${one} / ${other}`);
    }));
}
return pairs;
"""


# Percentage of holes in the first map of heights, by their colour.
HOLES = """
const done = arguments[arguments.length - 1];
const picture = new Image();
picture.onload = () => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    const pixels = context.getImageData(0, 0, canvas.width, canvas.height).data;
    let holes = 0;
    for (let at = 0; at < pixels.length; at += 4)
        holes += pixels[at] === 213 && pixels[at + 1] === 46 && pixels[at + 2] === 35;
    done(400 * holes / pixels.length);
};
picture.src = document.querySelector("#surfaces .panel svg image").getAttribute("href");
"""

# Text of a scale bar, and number of missing points of a map.
LENGTH = re.compile(r"[125]0* (pm|nm|µm|mm|m)")
MISSING = re.compile(r"([0-9.]+) % missing")


def browser():
    options = webdriver.ChromeOptions()
    for argument in ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=webdriver.ChromeService("/usr/bin/chromedriver"))


def look(driver, size, scheme):
    width, height = size
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": features})


def picture(driver, path):
    shot = driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True})
    path.write_bytes(base64.b64decode(shot["data"]))


def check_sorting(driver):
    """Checks that a click sorts by a column and a second one reverses the order, in the first suitable table."""
    column = lambda table, at: driver.execute_script(
        "return [...arguments[0].tBodies[0].rows].map((row) => parseFloat(row.cells[arguments[1]].textContent))",
        table, at)

    def unsorted():
        """Returns a heading whose column is not sorted yet; a table of one row has none."""
        for table in driver.find_elements(By.CSS_SELECTOR, "#tables details table"):
            driver.execute_script("arguments[0].closest('details').open = true", table)
            for heading in table.find_elements(By.CSS_SELECTOR, "th.number"):
                at = int(driver.execute_script("return arguments[0].cellIndex", heading))
                values = column(table, at)
                if values not in (sorted(values), sorted(values, reverse=True)) and None not in values:
                    return table, heading, at
        return None

    found = unsorted()
    if found is None:
        return False
    table, heading, at = found
    driver.execute_script("arguments[0].closest('details').open = true", table)
    button = heading.find_element(By.TAG_NAME, "button")
    driver.execute_script("arguments[0].click()", button)
    values = column(table, at)
    assert values == sorted(values), "the first press sorts upwards"
    assert heading.get_attribute("aria-sort") == "ascending"
    button.send_keys(Keys.ENTER)
    assert column(table, at) == sorted(values, reverse=True), "the key sorts downwards"
    return True


def check_sliders(driver):
    """Checks that keys, mouse and touch select a load, and that map and text belong to it."""
    sliders = driver.find_elements(By.CSS_SELECTOR, ".loads")
    several = len(driver.find_elements(By.CSS_SELECTOR, "#contact-maps .panel")) > 2
    assert sliders or not several, "each page with contact maps under several loads has sliders"
    for loads in sliders:
        slider, output = loads.find_element(By.TAG_NAME, "input"), loads.find_element(By.TAG_NAME, "output")
        maps = loads.find_elements(By.TAG_NAME, "img")
        assert slider.is_displayed() and slider.accessible_name and len(maps) > 1
        last = len(maps) - 1

        def is_at(step):
            assert int(slider.get_attribute("value")) == step, (slider.get_attribute("value"), step)
            assert [at for at, shown in enumerate(maps) if shown.is_displayed()] == [step]
            assert driver.execute_script("return arguments[0].naturalWidth", maps[step]) > 0
            for told in ["load", "area", "gap"]:
                told = maps[step].get_attribute(f"data-{told}")
                assert told in output.text and told in slider.get_attribute("aria-valuetext"), told

        slider.send_keys(Keys.HOME)
        is_at(0)
        slider.send_keys(Keys.ARROW_RIGHT)
        is_at(1)
        slider.send_keys(Keys.END)
        is_at(last)
        edge = slider.size["width"] // 2 - 4
        ActionChains(driver).move_to_element_with_offset(slider, -edge, 0).click().perform()
        is_at(0)
        finger = ActionBuilder(driver, mouse=PointerInput(POINTER_TOUCH, "finger"))
        finger.pointer_action.move_to(slider, edge, 0).pointer_down().pointer_up()
        finger.perform()
        is_at(last)
        areas = [float(shown.get_attribute("data-area").removesuffix(" %")) for shown in maps]
        assert areas == sorted(areas) and areas[0] < areas[-1], areas
    return len(sliders)


ORDER = ["summary", "declared", "results", "paper", "maps", "tables", "missing", "provenance"]


def check_order(driver):
    """Checks that the page begins with a summary, and that its parts follow in a fixed order."""
    found = [part.get_attribute("id") for part in driver.find_elements(By.CSS_SELECTOR, "section")]
    assert found == [part for part in ORDER if part in found], found
    assert {"summary", "tables", "provenance"} <= set(found), found
    first = driver.execute_script("return document.querySelector('main').firstElementChild.id")
    assert first == "summary", first
    terms = [term.text for term in driver.find_elements(By.CSS_SELECTOR, "#summary dt")]
    assert terms[0] == "varied" and "surfaces" in terms and terms[-1] == "state", terms


def check_hover(driver):
    """Checks that each chart tells the values of the point below the pointer, and that keys go to the next one."""
    tip = lambda: driver.find_element(By.CSS_SELECTOR, ".tip")
    charts = driver.find_elements(By.CSS_SELECTOR, "figure .chart")
    for chart in charts:
        # The box of the chart itself reaches as far as curves continue beyond its axes.
        data = chart.find_element(By.CSS_SELECTOR, "[data-points] *")
        driver.execute_script("arguments[0].scrollIntoView({ block: 'center' })", data)
        svg = chart.find_element(By.XPATH, "./ancestor::*[name()='svg']")
        group = chart.find_element(By.CSS_SELECTOR, "[data-points]")
        x, y = group.get_attribute("data-points").split(" ")[0].split(",")[:2]
        at = driver.execute_script("""
            const [chart, x, y] = arguments;
            const [left, top, width, height] = chart.dataset.box.split(" ").map(Number);
            const share = (axis, value) => {
                const [from, to, spacing] = axis.split(" ");
                const place = spacing === "log" ? Math.log : Number;
                return (place(value) - place(Number(from))) / (place(Number(to)) - place(Number(from)));
            };
            const point = new DOMPoint(left + width * share(chart.dataset.x, Number(x)),
                top + height * (1 - share(chart.dataset.y, Number(y)))).matrixTransform(chart.getScreenCTM());
            return [Math.round(point.x), Math.round(point.y)];""", chart, x, y)
        pointer = ActionBuilder(driver)
        pointer.pointer_action.move_to_location(*at)
        pointer.perform()
        assert tip().is_displayed(), (at, x, y)
        label = chart.get_attribute("data-x-label")
        shown = tip().text
        # Subscripts are shown without the `_` before them.
        assert all(f"{name.replace('_', '')}: " in shown for name in [label, chart.get_attribute("data-y-label")]), shown
        ring = chart.find_element(By.CSS_SELECTOR, ".ring").rect
        centre = [ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2]
        scroll = driver.execute_script("return [scrollX, scrollY]")
        away = max(abs(c - s - a) for c, s, a in zip(centre, scroll, at))
        assert away < 4, (centre, scroll, at)
        svg.send_keys(Keys.ARROW_RIGHT)
        assert tip().is_displayed()
    pointer = ActionBuilder(driver)
    pointer.pointer_action.move_to_location(1, 1)
    pointer.perform()
    driver.execute_script("document.activeElement.blur()")
    assert not tip().is_displayed()
    return len(charts)


def check_hiding(driver):
    """Checks that a click on an entry of a legend hides its series, and a second one or a key shows it again."""
    entries = driver.find_elements(By.CSS_SELECTOR, ".legend li")
    for entry in entries:
        figure = entry.find_element(By.XPATH, "./ancestor::figure")
        of = entry.get_attribute("data-entry")
        groups = lambda: figure.find_elements(By.CSS_SELECTOR, f".series[data-entry='{of}']")
        hidden = lambda: {driver.execute_script("return getComputedStyle(arguments[0]).display", g) for g in groups()}
        others = figure.find_elements(By.CSS_SELECTOR, f".series:not([data-entry='{of}'])")
        assert groups() and hidden() == {"inline"}, entry.text
        driver.execute_script("arguments[0].click()", entry)
        assert hidden() == {"none"} and entry.get_attribute("aria-pressed") == "false"
        assert all(driver.execute_script("return getComputedStyle(arguments[0]).display", g) != "none" for g in others)
        entry.send_keys(Keys.ENTER)
        assert hidden() == {"inline"} and entry.get_attribute("aria-pressed") == "true"
    return len(entries)


def check_measured(driver):
    """Checks units of lengths, scale bars and the area of holes on a page with measured surfaces."""
    bars = driver.find_elements(By.CSS_SELECTOR, ".loads .scale")
    if not bars:
        return None
    for bar in bars:
        assert LENGTH.fullmatch(bar.text), bar.text
        line = bar.find_element(By.TAG_NAME, "span").size["width"]
        maps = bar.find_element(By.XPATH, "..").find_element(By.CLASS_NAME, "shown").size["width"]
        assert 0.05 * maps < line < 0.4 * maps, (line, maps)
    words = lambda figure: [text.text for text in driver.find_elements(By.CSS_SELECTOR, f"#{figure} .panel svg text")]
    for figure in ["surfaces", "contact-maps"]:
        assert any(LENGTH.fullmatch(text) for text in words(figure)), figure
    for figure, unit in [("heights", "m"), ("spectrum", "m⁴"), ("slope-at-scale", "m"), ("pressure", "Pa")]:
        assert any(text.endswith(unit) for text in words(figure)), (figure, words(figure))
    missing = [MISSING.search(text) for text in words("surfaces")]
    missing = next((float(found[1]) for found in missing if found), 0.0)
    holes = driver.execute_async_script(HOLES)
    assert abs(holes - missing) <= 0.1 * missing + 0.1, (holes, missing)
    return f"{holes:.1f} % of holes"


def check_maps_without_slider(driver, page):
    """Checks that all maps and no slider are visible on paper and without scripts."""
    shown = lambda: (driver.find_element(By.CSS_SELECTOR, "#contact-maps .panel svg").is_displayed(),
                     any(loads.is_displayed() for loads in driver.find_elements(By.CSS_SELECTOR, ".loads")))
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert shown() == (True, False), "on paper"
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    driver.get(page.resolve().as_uri())
    assert shown() == (True, False), "without scripts"
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    driver.get(page.resolve().as_uri())


def check(driver, page, pictures):
    look(driver, WIDE, "light")
    driver.get(page.resolve().as_uri())
    figures = driver.execute_script("return document.querySelectorAll('figure').length")
    check_order(driver)
    backticks = [line.strip() for line in driver.execute_script(TEXT).splitlines() if "`" in line]
    assert not backticks, backticks
    alone = driver.execute_script(ONE_PLACE)
    assert not alone, alone
    undrawn = driver.execute_script(UNDRAWN)
    assert figures > 0 and not undrawn, undrawn
    overlaps = driver.execute_script(OVERLAPS)
    assert not overlaps, overlaps
    fetched = driver.execute_script("return performance.getEntriesByType('resource')"
                                    ".map((r) => r.name).filter((n) => !n.startsWith('data:'))")
    assert not fetched, fetched
    sorted_by = "sorted" if check_sorting(driver) else "nothing to sort"
    shown, hidden = check_hover(driver), check_hiding(driver)
    sliders = check_sliders(driver)
    measured = check_measured(driver)
    if sliders:
        check_maps_without_slider(driver, page)
    name = page.parent.name
    contrasts = []
    for scheme in ["light", "dark"]:
        for device, size in [("wide", WIDE), ("phone", PHONE)]:
            look(driver, size, scheme)
            contrast, text = driver.execute_script(CONTRAST)
            assert contrast >= 4.5, (scheme, device, contrast, text)
            contrasts.append(contrast)
            sideways = driver.execute_script("return document.documentElement.scrollWidth")
            assert sideways <= size[0], (device, sideways)
            height, text = driver.execute_script(SMALLEST)
            assert height >= 10, (device, height, text)
            if pictures:
                picture(driver, pictures / f"{name}-{scheme}-{device}.png")
    look(driver, WIDE, "light")
    paper = base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {})["data"])
    assert paper.startswith(b"%PDF") and len(paper) > 10_000
    errors = [entry["message"][-300:] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
    assert not errors, errors
    told = [f"{figures} figures", f"{shown} charts with values", f"{hidden} series to hide", f"{sliders} sliders", sorted_by, measured,
            f"contrast at least {min(contrasts):.1f}", "no errors"]
    print(f"{page}: {', '.join(filter(None, told))}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path)
    arguments = parser.parse_args()
    if arguments.pictures:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
    driver = browser()
    try:
        for page in arguments.pages:
            check(driver, page, arguments.pictures)
    finally:
        driver.quit()


if __name__ == "__main__":
    main()
