// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/report_kit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <regex>

#include "problems/report/pictures/image.h"
#include "problems/report/plain_names.h"
#include "problems/report/plots/svg_parts.h"
#include "problems/report/report_assets.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

ReportImage Picture(std::string alt) {
  return {.bytes = EncodePng(MakeImage(8, 6, {0.2, 0.4, 0.6})), .caption = "A <b>", .alt = alt};
}

Report Full() {
  Report report{.title = "Face of \"A & B\" <1>",
                .subtitle = "it's one line",
                .notes = {"of <i> note"},
                .main_images = {Picture("the recovered face")},
                .tiles = {{"mean error", "1.84", "mm", "within 2.5 mm: 74 %"}},
                .sections = {},
                .footer = "Semblance"};
  report.sections.push_back(
      {.heading = "Depths & dowels",
       .paragraphs = {"a < b", "http is a word"},
       .images = {Picture("a \"quoted\" view")},
       .tables = {{.caption = "Depths",
                   .header = {"site", "depth (mm)", "note"},
                   .rows = {{"g", "5.25", "1st"}, {"n", "-6.5", "x"}, {"go_l", "", "2 > 1"}}}},
       .preformatted = "a: 1\n  b: <2>\n"});
  report.sections.push_back({.heading = "Inputs", .paragraphs = {"for who asks"}, .folded = true});
  return report;
}

int Count(const std::string& text, const std::string& regex) {
  const std::regex pattern(regex);
  return static_cast<int>(std::distance(std::sregex_iterator(text.begin(), text.end(), pattern),
                                        std::sregex_iterator()));
}

TEST(Html, SpecialCharactersAreEscaped) {
  EXPECT_EQ(EscapeHtml("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(EscapeHtml(std::string_view("a\0b\tc\r\n", 7)), "a\uFFFDb\tc\n");
}

TEST(Html, TextOfTheReportIsEscapedEverywhere) {
  const std::string html = ReportHtml(Full());
  EXPECT_THAT(html, AllOf(HasSubstr("<h1>Face of &quot;A &amp; B&quot; &lt;1&gt;</h1>"),
                          HasSubstr("<title>Face of &quot;A &amp; B&quot; &lt;1&gt;</title>"),
                          HasSubstr("it&#39;s one line"), HasSubstr("<p>a &lt; b</p>"),
                          HasSubstr("Depths &amp; dowels</h2>"), HasSubstr("b: &lt;2&gt;\n</pre>"),
                          HasSubstr(">2 &gt; 1</td>"), HasSubstr("<p>of &lt;i&gt; note</p>"),
                          Not(HasSubstr("<b>"))));
}

TEST(Html, EveryImageIsInsideTheFileAndHasAltText) {
  const std::string html = ReportHtml(Full());
  EXPECT_EQ(Count(html, "<img"), 2);
  EXPECT_EQ(Count(html,
                  "<img alt=\"[^\"]+\" width=\"8\" height=\"6\" "
                  "src=\"data:image/png;base64,[A-Za-z0-9+/=]+\">"),
            2);
  EXPECT_THAT(html, HasSubstr("alt=\"a &quot;quoted&quot; view\""));
}

TEST(Html, NeedsNothingElse) {
  const std::string html = ReportHtml(Full());
  EXPECT_EQ(Count(html, "://|url\\(|@import|<script[^>]*src|<link|<iframe"), 0);
  EXPECT_EQ(Count(html, "src=\"(?!data:)"), 0);
  EXPECT_EQ(Count(html, "href=\"(?!#)"), 0);
}

TEST(Html, LegendsShowColoursAndTicks) {
  Report report = Full();
  report.main_images[0].legends = {
      {.map = DivergingMap(8), .title = "error & sign"},
      {.map = SequentialMap(0, 1), .title = "depth", .shows_no_data = false}};
  const std::string html = ReportHtml(report);
  EXPECT_THAT(html, HasSubstr("error &amp; sign (mm)"));
  EXPECT_THAT(html, HasSubstr("<span>\u22128</span><span>\u22124</span><span>0</span>"
                              "<span>+4</span><span>+8</span>"));
  EXPECT_THAT(html, HasSubstr("<span>0</span><span>0.25</span><span>0.5</span>"));
  EXPECT_EQ(Count(html, "no data</small>"), 1);
}

TEST(Table, CellsAreText) {
  ReportTable table{"", {"a", "b", "c", "d"}};
  table.AddRow("word", 1.23456, 7, kNaN);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"word", "1.235", "7", ""}));
  EXPECT_EQ(TableFigures(1234.5), "1.23e+03");
  EXPECT_EQ(TablePercent(0.1234), "12.3");
  EXPECT_EQ(IntervalText({.low = -1, .high = 2}), "-1.000 to 2.000");
}

TEST(Html, TagsAreBalanced) {
  // With its void elements closed, the page is XML, which a strict parser can check.
  std::string html = ReportHtml(Full());
  html.erase(html.find("<script>"), html.find("</script>") + 9 - html.find("<script>"));
  const std::string xml = std::regex_replace(html.substr(html.find("<html")),
                                             std::regex("<((meta|img)[^>]*)>"), "<$1/>");
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_string(xml.c_str());
  EXPECT_TRUE(parsed) << parsed.description() << ": " << xml.substr(parsed.offset, 80);
  EXPECT_STREQ(document.select_node("//section[1]/h2").node().attribute("id").value(), "score");
  // Each entry of the contents leads to a heading, and each heading is there.
  std::vector<std::string> ids, links;
  for (const auto& heading : document.select_nodes("//h2")) {
    ids.push_back(std::string("#") + heading.node().attribute("id").value());
  }
  for (const auto& link : document.select_nodes("//nav//a")) {
    links.emplace_back(link.node().attribute("href").value());
  }
  EXPECT_EQ(links, ids);
  EXPECT_EQ(document.select_nodes("//tbody/tr").size(), 3u);
}

TEST(Html, ColumnsOfNumbersAreAlignedRight) {
  const std::string html = ReportHtml(Full());
  EXPECT_THAT(html, AllOf(HasSubstr("<td class=\"n\" data-head=\"depth (mm)\">5.25</td>"),
                          HasSubstr("<th scope=\"col\" class=\"n\">depth (mm)</th>"),
                          HasSubstr("<td class=\"n\" data-head=\"depth (mm)\">\u2013</td>"),
                          HasSubstr("<td data-head=\"note\">1st</td>")));
}

TEST(Html, SameReportSameBytes) { EXPECT_EQ(ReportHtml(Full()), ReportHtml(Full())); }

TEST(Html, InvalidPartsAreRefused) {
  Report report = Full();
  report.sections[0].tables[0].rows[1].pop_back();
  EXPECT_THROW(ReportHtml(report), InputError);
  report = Full();
  report.main_images[0].alt.clear();
  EXPECT_THROW(ReportHtml(report), InputError);
  report = Full();
  report.main_images[0].bytes = "GIF89a";
  EXPECT_THROW(ReportHtml(report), InputError);
  EXPECT_THROW(ReportImageFromFile("/nowhere/x.png", "", "x"), IoError);
}

TEST(Html, AnSvgIsPartOfThePage) {
  Report report = Full();
  report.main_images = {{.bytes = "<?xml version=\"1.0\"?>\n<svg width=\"2\"><circle/></svg>\n",
                         .caption = "",
                         .alt = "a \"plot\""}};
  EXPECT_THAT(ReportHtml(report),
              HasSubstr("<figure><svg class=\"plot\" role=\"img\" aria-label=\"a "
                        "&quot;plot&quot;\" width=\"2\"><circle/></svg>"));
}

TEST(Html, OnlyTheFirstThreeNotesAreShownAtOnce) {
  Report report = Full();
  report.notes = {"first", "second", "third"};
  EXPECT_THAT(ReportHtml(report), Not(HasSubstr(" more</summary>")));
  report.notes.insert(report.notes.end(), {"fourth", "fifth"});
  const std::string html = ReportHtml(report);
  const std::size_t fold = html.find("<details><summary>2 more</summary>");
  ASSERT_NE(fold, html.npos);
  EXPECT_LT(html.find("<p>third</p>"), fold);
  EXPECT_GT(html.find("<p>fourth</p>"), fold);
}

TEST(Html, PicturesThenTheScoreThenNotesThenTheRest) {
  const std::string html = ReportHtml(Full());
  const std::vector<std::string> order = {"<nav ",
                                          "alt=\"the recovered face\"",
                                          "id=\"score\"",
                                          "class=\"tiles\"",
                                          "id=\"notes\"",
                                          "id=\"s1\"",
                                          "<details class=\"fold\"><summary><h2 id=\"s2\">"};
  std::size_t at = 0;
  for (const std::string& part : order) {
    const std::size_t found = html.find(part, at);
    ASSERT_NE(found, std::string::npos) << part;
    at = found;
  }
}

TEST(Html, RowsHaveIdsAndLinksThatAreEscaped) {
  Report report = Full();
  ReportTable& table = report.sections[0].tables[0];
  table.ids = {"a\"b", ""};
  table.links = {"#x", "", "y.html?<"};
  for (int row = 3; row < 13; ++row) {
    table.AddRow("x", 1.5, row);
  }
  EXPECT_THAT(ReportHtml(report),
              AllOf(HasSubstr("<tr id=\"a&quot;b\"><td data-head=\"site\"><a href=\"#x\">g</a>"),
                    HasSubstr("<a href=\"y.html?&lt;\">go_l</a>"), HasSubstr("data-filter")));
}

TEST(Html, WithoutThreeJsThePageExplainsWhy) {
  Report report = Full();
  report.scenes = "{\"scenes\": [], \"blobs\": {}}";
  EXPECT_THAT(ReportHtml(report),
              HasSubstr(ThreeScript().empty() ? "built without three.js" : "<noscript>"));
}

TEST(PlainNames, AKeyBecomesWordsWithItsUnit) {
  EXPECT_EQ(WordsOfKey("dowel_rms_mm"), "RMS distance of the depth markers (mm)");
  EXPECT_EQ(WordsOfKey("some_new_count"), "some new count");
  EXPECT_EQ(WordsOfKey("some_new_area_cm2"), "some new area (cm²)");
  EXPECT_EQ(WordsOfKey("_mm"), " mm");
  EXPECT_EQ(WordsOfKey("eye_l"), "eye, left");
  EXPECT_EQ(WordsOfKey("_r"), " r");
  EXPECT_EQ(WordsOfMeasure("rms_mm"), "RMS distance (mm)");
  EXPECT_EQ(WordsOfMeasure("coverage_90"), "coverage_90");
}

TEST(PlainNames, AMetricKeepsItsPath) {
  EXPECT_EQ(WordsOfMetric("face.rms_mm"), "RMS distance (mm) of the recovered face (face.rms_mm)");
  EXPECT_EQ(
      WordsOfMetric("face.regions.nose.p95_mm"),
      "95th percentile of the distance (mm) of the recovered face (face.regions.nose.p95_mm)");
  EXPECT_EQ(WordsOfMetric("identify.rank"), "identify.rank");
  EXPECT_EQ(WordsOfMetric("rms_mm"), "rms_mm");
}

TEST(PlainNames, ASiteHasItsNameAndSide) {
  EXPECT_EQ(WordsOfSite("go_l"), "Gonion, left (go_l)");
  EXPECT_EQ(WordsOfSite("g"), "Glabella (g)");
  EXPECT_EQ(WordsOfSite("no site <"), "no site <");
}

TEST(PlainNames, OneIsSingular) {
  EXPECT_EQ(Counted(1, "subject"), "1 subject");
  EXPECT_EQ(Counted(0, "subject"), "0 subjects");
  EXPECT_EQ(Counted(2, "trial is", "trials are"), "2 trials are");
}

}  // namespace
}  // namespace semblance::problems
