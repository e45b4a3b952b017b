"""The report: one file, complete, harmless, and the same in a browser and on paper."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from functools import cache
from html import escape, unescape
from html.parser import HTMLParser

import pytest
from markupsafe import Markup

from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import ChartError, OutOfReach
from zwidth.show import gather, json_text, write_report
from zwidth.show.report import facts as facts_module
from zwidth.show.report.report import keep_units, page

NO_STABLE_WALL = ["plant.damping_Ns_per_m=unset", "loop.delay_samples=1"]
CASES = {
    "five-bar": ("five-bar", []),
    "late": ("hapkit-course", ["loop.delay_samples=1"]),
    "two-mass": ("published-two-mass", []),
    "nothing stable": ("published-two-mass", NO_STABLE_WALL),
    "one mass": ("hapkit-course", []),
    "under load": ("five-bar", ["load.push_N=-5"]),
}
VOID = {"meta", "br", "link", "img", "wbr", "hr"}
HTML_IN_NAME = "<script>alert('x')</script> & \"quotes\" {{ 7*7 }} --> ü"


class Page(HTMLParser):
    """The tags, attributes and text of a page; fails where tags do not nest."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.texts = [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.texts).replace("\u00a0", " "))


@pytest.fixture(scope="module")
def report_of(tmp_path_factory):
    """Path, numbers and text of a case's report, which is made once."""

    @cache
    def made(case):
        name, changes = CASES[case]
        path = tmp_path_factory.mktemp("report") / "report.html"
        found = write_report(load(name, changes), path)
        return path, found, path.read_text(encoding="utf-8")

    return made


@pytest.fixture(params=CASES)
def report(request, report_of):
    return report_of(request.param)


def test_the_page_stands_alone(report):
    parsed = Page(report[2])
    assert not {"script", "link", "img", "iframe", "object", "base"} & set(parsed.tags)
    for name, value in parsed.attributes:
        if name in ("src", "href", "xlink:href", "action", "data"):
            assert value.startswith("#")
        assert not name.startswith("on")
        for target in re.findall(r"url\(([^)]*)\)", value or ""):
            assert target.strip("'\"").startswith("#")
    assert "@import" not in report[2]


def test_every_id_is_given_once_and_every_reference_leads_somewhere(report):
    parsed = Page(report[2])
    ids = [value for name, value in parsed.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    references = [value[1:] for name, value in parsed.attributes if name == "href"]
    references += re.findall(r"url\(#([^)]*)\)", report[2])
    assert set(references) <= set(ids)


def test_what_it_says_is_what_it_returns(report):
    path, found, text = report
    shown = Page(text).text
    assert found["file"] == str(path)
    for sentence in found["summary"]:
        assert sentence.replace("\u00a0", " ") in shown
    json.loads(json_text(found))


def test_all_sections_are_there(report):
    _, found, text = report
    headings = ["Which walls it renders", "What limits it", "What simpler models say", "The device",
                "What published conditions say", "Where the numbers come from"]  # fmt: skip
    if found["stiffness_max_N_per_m"] is not None:
        headings += ["At which frequency it oscillates", "How fast it comes to rest", "What to change first"]
    shown = Page(text).text
    assert [heading for heading in headings if heading not in shown] == []
    for entry in found["bounds"]:
        assert entry["name"] in shown
    for entry in found["what_if"]:
        assert entry["label"] in shown or entry["key"] == f"model-{found['model']}"


def test_the_numbers_of_the_published_plant(report_of):
    _, found, _ = report_of("two-mass")
    assert found["stiffness_max_N_per_m"] == pytest.approx(7133.86929380, rel=1e-9)
    assert found["damping_at_stiffness_max_Ns_per_m"] == pytest.approx(9.97478812, rel=1e-6)
    assert found["frequencies_at_stiffness_max_Hz"] == pytest.approx([174.547436], rel=1e-6)
    assert found["link_side_mass_kg"] == pytest.approx(0.2616)
    gains = {entry["key"]: entry["stiffness_max_N_per_m"] for entry in found["what_if"]}
    assert gains["one-sample"] == pytest.approx(1101.30206608, rel=1e-9)
    assert gains["no-delay"] is None


def test_the_numbers_of_what_to_change_is_felt_and_may_be_simplified(report_of):
    _, found, text = report_of("two-mass")
    first = found["sensitivities"][0]
    assert first["path"] == "loop.sampling_period_s"
    assert first["d_ln_stiffness_max_d_ln_value"] == pytest.approx(-2.8504059866, abs=1e-8)
    K, k = found["stiffness_max_N_per_m"], 15620.0
    assert found["static_stiffness_at_stiffness_max_N_per_m"] == pytest.approx(K * k / (K + k), rel=1e-9)
    assert found["static_stiffness_limit_N_per_m"] == pytest.approx(k, rel=1e-9)
    models = {entry["key"]: entry for entry in found["models"]["within"]}
    assert found["models"]["tolerance"] == 0.1
    assert found["models"]["first_natural_frequency_Hz"] == pytest.approx(130.727, abs=1e-3)
    assert models["rigid"]["frequency_ranges_Hz"][0][1] == pytest.approx(20.29, abs=0.01)
    # the figures are there, and only where they say something
    assert all(f'<figure id="{name}">' in text for name in ("felt", "sensitivities", "validity"))
    _, _, text = report_of("one mass")
    assert [name for name in ("felt", "sensitivities", "validity") if f'<figure id="{name}">' in text] == [
        "sensitivities"
    ]


def test_a_load_has_a_section_with_its_numbers(report_of):
    _, found, text = report_of("under load")
    shown = Page(text).text
    equilibrium, path = found["equilibrium"], found["load_path"]
    assert "Under load" in shown
    assert "Under load" not in Page(report_of("five-bar")[2]).text
    assert "equilibrium" not in report_of("five-bar")[1]
    assert f"hand gives ({equilibrium['hand_force_N'][0]:.4g}, -5) N".replace("-", "−") in shown
    assert path["push_N"] == [-5.0, -2.5, 0.0, 2.5, 5.0]
    assert path["stiffness_max_N_per_m"][0] == found["stiffness_max_N_per_m"]
    assert found["sideways_motions"][0]["growth_rate_1_per_s"] == path["growth_rate_1_per_s"][0]
    assert found["static_stiffness_limit_N_per_m"] is None  # the impedance at the handle is not known under load
    assert text.count('<figure id="load">') == 1


def test_links_that_could_bend_have_a_section_with_its_numbers(report_of):
    _, found, text = report_of("five-bar")
    shown, bent = Page(text).text, found["bending"]["bent"]
    assert text.count("<h2>Links that bend</h2>") == text.count("<caption>The tubes ") == 1
    assert "as rigid." in shown
    assert f"stiffness from {found['stiffness_max_N_per_m'] / 1e3:.3f} kN/m" in shown
    assert f"stiffer than {bent['static_stiffness_N_per_m'] / 1e3:.2f} kN/m" in shown
    assert found["bending"]["rigid"]["stiffness_max_N_per_m"] == found["stiffness_max_N_per_m"]
    limit = pytest.approx(found["static_stiffness_limit_N_per_m"], rel=1e-12)
    assert found["bending"]["rigid"]["static_stiffness_N_per_m"] == limit
    _, found, text = report_of("two-mass")
    assert found["bending"] is None
    assert "<h2>Links that" not in text


def test_nothing_stable_has_a_reason_and_nulls(report_of):
    _, found, _ = report_of("nothing stable")
    assert found["stiffness_max_N_per_m"] is None
    assert found["damping_at_stiffness_max_Ns_per_m"] is None
    assert found["reason"]
    assert found["stable_area_N2s_per_m2"] == 0.0
    assert found["sensitivities"] == []
    assert found["static_stiffness_at_stiffness_max_N_per_m"] is None


@pytest.mark.parametrize("case", ["five-bar", "one mass"])
def test_conditions_that_do_not_apply_are_folded(report_of, case):
    _, _, text = report_of(case)
    bounds = gather(load(*CASES[case])).bounds
    published = text[text.index("What published conditions say") : text.index("Where the numbers come from")]
    visible, _, folded = published.partition("<details>")
    for bound in bounds:
        name = f'<th scope="row">{escape(bound.name)}<br>'
        assert (name in visible) == bound.holds
        assert (name in folded) == (not bound.holds)
        for sentence in bound.violated:
            assert escape(sentence) in folded.replace("\u00a0", " ")
        assert all(re.search(rf"It needs [^.]*\b{name}\b", folded) for name in bound.lacking)
    assert published.count("this report") == ("<table" in visible) + bool(folded)


def test_numbers_keep_with_their_units(report):
    text = re.sub(r"<svg.*?</svg>|<style.*?</style>", "", report[2], flags=re.DOTALL)
    assert re.findall(r"\d (?:%|[kMmµ]?(?:Hz|N/m|s|m)\b|N s/m|kg|samples?\b)", text) == []
    assert keep_units("0.25 m, 1 kN/m and 3 masses") == "0.25\u00a0m, 1\u00a0kN/m and 3 masses"
    assert keep_units(Markup("1 Hz")) == "1 Hz"


def test_names_cannot_do_harm(tmp_path):
    document = load("hapkit-course").document | {
        "name": HTML_IN_NAME,
        "description": HTML_IN_NAME,
        "source": HTML_IN_NAME,
    }
    document["sources"] = {"plant.mass_kg": HTML_IN_NAME}
    text = page(gather(from_document(document)))
    parsed = Page(text)
    assert "script" not in parsed.tags
    assert HTML_IN_NAME in parsed.text.replace("  ", " ")
    assert "{{ 7*7 }}" in text


def test_the_same_device_makes_the_same_page(report_of):
    assert page(gather(load("published-two-mass"))) == report_of("two-mass")[2]


def test_questions_reach_the_page(tmp_path):
    device = load("five-bar")
    found = write_report(device, tmp_path / "a.html", device.at((0.02, 0.2), (1.0, 0.0), model="two-mass"))
    assert found["position_m"] == pytest.approx([0.02, 0.2, 0.0])
    assert found["model"] == "two-mass"
    assert "two-mass model" in found["summary"][0]


def test_a_posture_out_of_reach_writes_nothing(tmp_path):
    with pytest.raises(OutOfReach):
        write_report(load("five-bar"), tmp_path / "a.html", load("five-bar").at((5.0, 5.0)))
    assert list(tmp_path.iterdir()) == []


def test_a_chart_that_cannot_be_drawn_writes_nothing(tmp_path, monkeypatch):
    def fail(*_):
        raise ChartError("too fine")

    monkeypatch.setattr(facts_module, "what_if", fail)
    (tmp_path / "a.html").write_text("before")
    with pytest.raises(ChartError):
        write_report(load("hapkit-course"), tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text() == "before"
    assert len(list(tmp_path.iterdir())) == 1


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium here to render the page")


def browse(folder, *options):
    command = [
        BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        "--disable-background-networking", "--disable-component-update", "--no-first-run",
        f"--user-data-dir={folder / 'profile'}", *options,
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, timeout=120, check=True)


def shown_in_browser(folder, page):
    """The picture of a page, what the browser complained of, and what the page asked of other places."""
    shot, log = folder / "page.png", folder / "net.json"
    result = browse(
        folder, "--enable-logging=stderr", f"--log-net-log={log}", f"--screenshot={shot}",
        "--window-size=1000,3000", page.as_uri(),
    )  # fmt: skip
    complaints = [line for line in result.stderr.decode(errors="replace").splitlines() if "CONSOLE" in line]
    # The browser itself may ask its maker for updates, but not in the name of a page from a file.
    asked = log.read_text(errors="replace").count('"site_for_cookies":"SiteForCookies: {site=file://')
    return shot.read_bytes(), complaints, asked


@needs_browser
def test_a_browser_has_nothing_to_complain_of(tmp_path, report_of):
    picture, complaints, asked = shown_in_browser(tmp_path, report_of("five-bar")[0])
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 50_000
    assert complaints == []
    assert asked == 0


@needs_browser
def test_a_page_that_asks_elsewhere_would_be_noticed(tmp_path):
    target = tmp_path / "report.html"
    target.write_text("<img src='http://127.0.0.1:9/x.png'><script>console.error('x')</script>")
    _, complaints, asked = shown_in_browser(tmp_path, target)
    assert complaints
    assert asked


MEASURE = """<pre id="measured"></pre><script>onload = () => {
const page = document.querySelector("iframe").contentDocument;
const boxes = [...page.querySelectorAll("h1, h2, p, th, td, code, figcaption, summary, small")];
const drawn = [...page.querySelectorAll("figure svg")].filter(svg => svg.getBoundingClientRect().width);
const svg = drawn[0];
document.getElementById("measured").textContent = JSON.stringify({
  page: page.documentElement.scrollWidth,
  right: Math.max(...[...boxes, ...drawn].map(box => box.getBoundingClientRect().right)),
  drawings: drawn.length / page.querySelectorAll("figure").length,
  cut: boxes.filter(box => box.clientWidth && box.scrollWidth > box.clientWidth + 1).map(box => box.textContent),
  scale: svg.getBoundingClientRect().width / svg.viewBox.baseVal.width,
})};</script>"""
LONG = "/data/laboratory/haptics/measurements/2024-11-03/frequency_response_of_the_first_prototype_with_name.csv"


def measured_in_browser(folder, text, width):
    """Of a page in a frame of this width [px]: its own, its rightmost text, texts cut off, pixels per point."""
    unrestricted = re.sub(r"<meta http-equiv=.*?>", "", text).replace("<details>", "<details open>")
    frame = folder / "frame.html"
    frame.write_text(f'<iframe width="{width}" height="2000" srcdoc="{escape(unrestricted)}"></iframe>{MEASURE}')
    result = browse(folder, "--dump-dom", frame.as_uri())
    measured = re.findall(r'<pre id="measured">(.*?)</pre>', result.stdout.decode(), re.DOTALL)[-1]
    return json.loads(unescape(measured))


@cache
def page_of_long_names():
    document = load("published-two-mass").document | {"name": LONG, "description": LONG, "source": LONG}
    document["sources"] = {"plant.mass_kg": LONG, "plant.stiffness_N_per_m": "a table"}
    return page(gather(from_document(document)))


@needs_browser
@pytest.mark.parametrize("width", [400, 720, 1200])
def test_nothing_is_cut_off_or_too_small_to_be_read(tmp_path, width):
    found = measured_in_browser(tmp_path, page_of_long_names(), width)
    assert found["page"] <= width
    assert found["right"] <= width
    assert found["drawings"] == 1
    assert found["cut"] == []
    assert found["scale"] * 6.5 > 8.0  # the smallest text of a figure has 6.5 points


@needs_browser
def test_it_prints_on_a4(tmp_path, report):
    pdf = tmp_path / "report.pdf"
    browse(tmp_path, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", report[0].as_uri())
    printed = pdf.read_bytes()
    assert printed.startswith(b"%PDF")
    pages = len(re.findall(rb"/Type\s*/Page\b", printed))
    assert 2 <= pages <= (9 if "equilibrium" in report[1] else 8)
    sizes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", printed)
    assert {(round(float(w) / 72 * 25.4), round(float(h) / 72 * 25.4)) for w, h in sizes} == {(210, 297)}
