// SPDX-License-Identifier: GPL-3.0-or-later
// The 3-D view of a report in a browser: a script added to the page presses its buttons and counts
// pixels. The page must not use the network; any attempt is a fault.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/report/plots/svg_plot.h"
#include "problems/report/report_assets.h"
#include "problems/report/report_kit.h"
#include "problems/report/scene_json.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using testing::ScratchFolder;

constexpr const char* kListen = R"js(<script>
window.faults = [];
addEventListener('error', (e) => faults.push(e.message));
addEventListener('securitypolicyviolation', (e) => faults.push('policy: ' + e.blockedURI));
console.error = console.warn = (...words) => faults.push(words.join(' '));
</script>)js";

constexpr const char* kPress = R"js(<script>
addEventListener('load', () => setTimeout(() => {
  const canvases = [...document.querySelectorAll('.view3d-stage canvas')];
  const due = [];  // what waits for the next picture: made when it is read
  const picture = (canvas) => {
    for (const draw of due.splice(0)) { draw(); }
    const copy = Object.assign(document.createElement('canvas'), {width: canvas.width, height: canvas.height});
    const pen = copy.getContext('2d');
    pen.drawImage(canvas, 0, 0);
    return pen.getImageData(0, 0, copy.width, copy.height).data;
  };
  const inked = (data) => { let n = 0; for (let k = 0; k < data.length; k += 4) { n += data[k] < 250; } return n; };
  const changed = (a, b) => { let n = 0; for (let k = 0; k < a.length; ++k) { n += a[k] !== b[k]; } return n; };
  window.requestAnimationFrame = (draw) => { due.push(draw); return 0; };  // the first picture is there
  const out = {canvases: canvases.length, inked: canvases.map((c) => inked(picture(c))), toggles: {}};
  for (const box of document.querySelectorAll('input[data-layer]')) {
    const before = picture(canvases[0]);
    box.click();
    out.toggles[box.dataset.layer] = changed(before, picture(canvases[0]));
    box.click();
    out.toggles[box.dataset.layer] *= changed(before, picture(canvases[0])) === 0;
  }
  // The wheel and one finger belong to the page until the canvas is clicked, and again once the pointer has left.
  const taken = () => !canvases[0].dispatchEvent(new WheelEvent('wheel', {deltaY: 0, cancelable: true}));
  const press = (kind) => canvases[0].dispatchEvent(new PointerEvent(kind, {pointerId: 1, clientX: 5, clientY: 5}));
  canvases[0].setPointerCapture = () => {};
  out.wheel = [taken()];
  press('pointerdown');
  press('pointerup');
  out.wheel.push(taken());
  press('pointerleave');
  out.wheel.push(taken());
  out.touch = getComputedStyle(canvases[0]).touchAction;
  const choose = (select, value) => { select.value = value; select.dispatchEvent(new Event('change')); };
  const byText = (tag, text) => [...document.querySelectorAll(tag)].find((e) => e.textContent.includes(text));
  let before = picture(canvases[0]);
  choose(byText('.view3d-choice', 'faces by').querySelector('select'), 'error');
  out.coloured = changed(before, picture(canvases[0]));
  out.legend = byText('.view3d-legend', 'true skin').textContent;
  before = picture(canvases[0]);
  choose(byText('.view3d-choice', 'faces by').querySelector('select'), 'difference');
  out.differs = changed(before, picture(canvases[0]));
  out.differenceLegend = byText('.view3d-legend', 'other view') !== undefined;
  const choices = document.querySelectorAll('.view3d-head select');
  out.different = changed(picture(canvases[0]), picture(canvases[1]));
  choose(choices[1], '0');
  before = picture(canvases[0]);
  byText('.view3d-panel button', 'Left').click();
  setTimeout(() => {  // cameras draw with the next frame
    out.turned = changed(before, picture(canvases[0]));
    out.apart = changed(picture(canvases[0]), picture(canvases[1]));
    const table = document.querySelector('table'), cells = () => [...table.tBodies[0].rows].map((r) => r.cells[1].textContent);
    table.querySelectorAll('th button')[1].click();
    out.up = cells();
    table.querySelectorAll('th button')[1].click();
    out.down = cells();
    out.faults = faults;
    document.body.insertAdjacentHTML('beforeend', '<pre id="outcome">' + JSON.stringify(out) + '</pre>');
  }, 500);
}, 500));
</script>)js";

RunResult SmallRun(int random_seed, const std::string& override = "rounds=1") {
  const std::vector<std::string> overrides = {fmt::format("subject.random_seed={}", random_seed),
                                              "subject.rings=16",
                                              "implicit.resolution=16",
                                              "seeds.level=0",
                                              "template.max_level=1",
                                              "fit.plan.schedule=[{level: 0, fraction: 1}]",
                                              override};
  const auto experiment =
      ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
  return Run(experiment, {});
}

std::string Page() {
  const SceneCollection scenes = CollectScenes(
      {{"first </script>", SceneJson(SmallRun(1), {})}, {"second", SceneJson(SmallRun(2), {})}},
      1 << 30);
  Report report;
  report.title = "t";
  report.scenes = scenes.json;
  report.sections.push_back(
      {.heading = "s", .tables = {{"", {"a", "b"}, {{"x", "10"}, {"y", "9.5"}, {"z", ""}}}}});
  std::string html = ReportHtml(report);
  html.insert(html.find("<head>") + 6, kListen);
  return html + kPress;
}

class ReportViewThorough : public ::testing::Test {
 protected:
  void SetUp() override {
    if (ThreeScript().empty()) {
      GTEST_SKIP() << "built without three.js (Debian: libjs-three)";
    }
    if (std::system("command -v chromium > /dev/null") != 0) {
      GTEST_SKIP() << "there is no chromium here";
    }
  }
  // What the page's script has written, in a window of this size.
  nlohmann::json Outcome(const std::string& html, const std::string& size) {
    WriteFileAtomically(folder_ / "page.html", html);
    const std::string command = fmt::format(
        "HOME={0} timeout 120 chromium --headless --no-sandbox --use-gl=angle "
        "--use-angle=swiftshader --enable-unsafe-swiftshader --user-data-dir={0}/profile "
        "--window-size={1} --virtual-time-budget=20000 "
        "--dump-dom file://{0}/page.html > {0}/dom.html 2> {0}/log",
        folder_.Path().string(), size);
    EXPECT_EQ(std::system(command.c_str()), 0) << ReadFileBytes(folder_ / "log");
    const std::string dom = ReadFileBytes(folder_ / "dom.html");
    const std::size_t at = dom.rfind("<pre id=\"outcome\">");
    EXPECT_NE(at, dom.npos) << ReadFileBytes(folder_ / "log");
    return at == dom.npos
               ? nlohmann::json()
               : nlohmann::json::parse(dom.substr(at + 18, dom.find("</pre>", at) - at - 18));
  }

  ScratchFolder folder_;
};

TEST_F(ReportViewThorough, RendersTogglesLinksAndSortsWithoutAFault) {
  const nlohmann::json out = Outcome(Page(), "800,800");
  EXPECT_EQ(out["faults"], nlohmann::json::array());
  EXPECT_EQ(out["wheel"], nlohmann::json({false, true, false}));
  EXPECT_EQ(out["touch"], "pan-y");
  EXPECT_EQ(out["canvases"], 2);
  EXPECT_GT(out["inked"][0], 5000);
  EXPECT_GT(out["inked"][1], 5000);
  EXPECT_GE(out["toggles"].size(), 7u);
  for (const auto& [layer, pixels] : out["toggles"].items()) {
    EXPECT_GT(pixels, 50) << layer;  // hidden or shown, and back again
  }
  EXPECT_GT(out["coloured"], 5000);
  EXPECT_GT(out["differs"], 5000);
  EXPECT_EQ(out["differenceLegend"], true);
  EXPECT_GT(out["different"], 1000);
  EXPECT_GT(out["turned"], 5000);
  EXPECT_EQ(out["apart"], 0);  // the same scene twice, one camera
  EXPECT_EQ(out["up"], nlohmann::json({"9.5", "10", "–"}));
  EXPECT_EQ(out["down"], nlohmann::json({"10", "9.5", "–"}));
}

// Keeps what was drawn on a canvas, so that it can be read at any time.
constexpr const char* kKeepPictures = R"js(<script>
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, {...options, preserveDrawingBuffer: true});
};
</script>)js";

constexpr const char* kCountMarks = R"js(<script>
addEventListener('load', () => setTimeout(() => {
  const canvas = document.querySelector('.view3d-stage canvas'), copy = document.createElement('canvas');
  Object.assign(copy, {width: canvas.width, height: canvas.height});
  const pen = copy.getContext('2d');
  pen.drawImage(canvas, 0, 0);
  const data = pen.getImageData(0, 0, copy.width, copy.height).data;
  let red = 0;
  for (let k = 0; k < data.length; k += 4) { red += data[k] > 190 && data[k + 1] < 20 && data[k + 2] < 20; }
  const out = {red, faults, labels: [...document.querySelectorAll('.view3d-label.fault')].map((label) => label.title),
               notes: [...document.querySelectorAll('.notes .fault')].map((note) => note.textContent),
               facts: document.querySelector('.view3d-facts.fault')?.textContent || ''};
  document.body.insertAdjacentHTML('beforeend', '<pre id="outcome">' + JSON.stringify(out) + '</pre>');
}, 4000));
</script>)js";

TEST_F(ReportViewThorough, MarksFaultsInRedAtTheirPlaces) {
  const RunResult run = SmallRun(1, "plausibility.direction_deg=0.001");
  ASSERT_EQ(run.Faults().size(), 1u);
  Report report;
  report.title = "t";
  report.faults = run.Faults();
  report.scenes = CollectScenes({{"one", SceneJson(run, {})}}, 1 << 30).json;
  std::string html = ReportHtml(report);
  html.insert(html.find("<head>") + 6, std::string(kListen) + kKeepPictures);
  const nlohmann::json out = Outcome(html + kCountMarks, "1400,1200");
  EXPECT_EQ(out["faults"], nlohmann::json::array());
  EXPECT_EQ(out["labels"], nlohmann::json(run.Faults()));
  EXPECT_EQ(out["notes"], nlohmann::json({"The result is not usable: " + run.Faults()[0]}));
  EXPECT_THAT(out["facts"].get<std::string>(), ::testing::StartsWith("not usable"));
  EXPECT_GT(out["red"], 30);
}

// A phone: 400 pixels. Tables of many columns are cards, contents and folded parts open on demand.
constexpr const char* kOnAPhone = R"js(<script>
addEventListener('load', () => setTimeout(() => {
  const fold = document.querySelector('details.fold');
  const out = {width: innerWidth, contents: document.querySelector('nav details').open, folded: !fold.open};
  for (const part of document.querySelectorAll('details')) { part.open = true; }
  out.across = document.documentElement.scrollWidth;
  out.boxes = [...document.querySelectorAll('.scroll')].filter((box) => box.scrollWidth > box.clientWidth + 1).length;
  const plot = document.querySelector('svg.plot'), wide = () => plot.getBoundingClientRect().width;
  const tap = () => plot.dispatchEvent(new MouseEvent('click', {bubbles: true}));
  out.plot = [wide()];
  for (let n = 0; n < 2; ++n) { tap(); out.plot.push(wide()); out.across = Math.max(out.across, document.documentElement.scrollWidth); }
  fold.open = false;
  location.hash = 'row-9';
  setTimeout(() => {
    out.opened = fold.open;
    const filter = document.querySelector('input[type=search]'), rows = [...document.querySelectorAll('tr[id]')];
    filter.value = 'row 12';
    filter.dispatchEvent(new Event('input'));
    out.left = rows.filter((row) => !row.hidden).map((row) => row.id);
    out.faults = faults;
    document.body.insertAdjacentHTML('beforeend', '<pre id="outcome">' + JSON.stringify(out) + '</pre>');
  }, 100);
}, 0));
</script>)js";

TEST_F(ReportViewThorough, FitsAPhoneAndFindsWhatIsFolded) {
  Report report;
  report.title = "a_title_without_a_single_blank_in_it_that_goes_on_and_on_and_on_and_on_and_on";
  report.notes = {"a note"};
  report.tiles = {{"mean", "1", "mm", ""}};
  ReportTable table{"many columns", {"a", "b", "c", "d", "e", "f", "g", "h"}};
  for (int row = 0; row < 20; ++row) {
    table.rows.emplace_back(8, fmt::format("row {} of words_that_cannot_be_broken", row));
    table.ids.push_back(fmt::format("row-{}", row));
  }
  report.main_images = {{BoxPlotSvg({{"row", {1, 2, 3}}}, "axis"), "caption", "a plot"}};
  report.sections.push_back({.heading = "open", .preformatted = std::string(300, 'x')});
  report.sections.push_back({.heading = "folded", .tables = {table}, .folded = true});
  std::string html = ReportHtml(report);
  html.insert(html.find("<head>") + 6, kListen);
  const nlohmann::json out = Outcome(html + kOnAPhone, "400,800");
  EXPECT_EQ(out["faults"], nlohmann::json::array());
  EXPECT_LE(out["across"], out["width"]);
  EXPECT_EQ(out["boxes"], 0);
  EXPECT_LE(out["plot"][0], out["width"]);
  EXPECT_EQ(out["plot"][1], 900);  // as it was made
  EXPECT_EQ(out["plot"][2], out["plot"][0]);
  EXPECT_EQ(out["contents"], false);
  EXPECT_EQ(out["folded"], true);
  EXPECT_EQ(out["opened"], true);
  EXPECT_EQ(out["left"], nlohmann::json({"row-12"}));
}

}  // namespace
}  // namespace semblance::problems
