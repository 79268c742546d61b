// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/rater_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <utility>

#include "problems/study/rater_faces.h"
#include "problems/study/rater_template.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFewestFaces = 2, kMostFaces = 9;

void CheckOptions(const RaterPageOptions& o) {
  const std::size_t persons = o.runs.size() + o.others.size();
  if (o.pool < kFewestFaces || o.pool > kMostFaces) {
    throw InputError(fmt::format("raters: a pool of {} faces; 2 to 9 are allowed", o.pool));
  }
  if (o.runs.empty() || persons < static_cast<std::size_t>(o.pool)) {
    throw InputError(fmt::format(
        "raters: a pool of {} faces needs as many persons, and there are {}; name more runs, or "
        "give a smaller --pool",
        o.pool, persons));
  }
}

std::vector<RaterFace> ReadFaces(const RaterPageOptions& options) {
  std::vector<RaterFace> faces;
  std::set<std::string> names;
  for (const std::vector<fs::path>* const list : {&options.runs, &options.others}) {
    for (const fs::path& run : *list) {
      const RaterFace& face = faces.emplace_back(ReadRaterFace(run));
      if (!names.insert(face.person).second) {
        throw InputError(
            fmt::format("raters: two folders are named '{}'; rename one, or name each person once",
                        face.person));
      }
    }
  }
  return faces;
}

// The persons in the pool of a question: its own and others, in random order.
std::vector<std::size_t> DrawPool(std::size_t own, std::size_t persons, int size, Random& random) {
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < persons; ++k) {
    if (k != own) {
      others.push_back(k);
    }
  }
  random.Shuffle(others);
  others.resize(static_cast<std::size_t>(size) - 1);
  others.push_back(own);
  random.Shuffle(others);
  return others;
}

// Stores pictures in random order, so that their places betray nothing.
class PictureShelf {
 public:
  PictureShelf(std::size_t count, Random& random) : places_(count), pictures_(count) {
    std::iota(places_.begin(), places_.end(), 0);
    random.Shuffle(places_);
  }

  void Put(std::size_t number, const Image& image) {
    pictures_[places_[number]] = "data:image/png;base64," + Base64(EncodePng(image));
  }
  std::size_t Place(std::size_t number) const { return places_[number]; }
  const std::vector<std::string>& All() const { return pictures_; }

 private:
  std::vector<std::size_t> places_;
  std::vector<std::string> pictures_;
};

// Pictures: the true skins of all persons, then the recovered faces of the runs.
PictureShelf DrawAll(const std::vector<RaterFace>& faces, std::size_t runs, Random& random,
                     const RunContext& context) {
  PictureShelf shelf(faces.size() + runs, random);
  for (std::size_t k = 0; k < faces.size() + runs; ++k) {
    context.ThrowIfStopped();
    context.Report("pictures", "",
                   static_cast<double>(k) / static_cast<double>(faces.size() + runs));
    const bool is_skin = k < faces.size();
    shelf.Put(k, DrawRaterFace(is_skin ? faces[k].skin : faces[k - faces.size()].recovered, random,
                               context.threads));
  }
  return shelf;
}

std::string FilledTemplate(const Json& data) {
  constexpr std::string_view kMark = "SEMBLANCE_RATER_DATA";
  std::string html(RaterTemplate());
  return html.replace(html.find(kMark), kMark.size(), data.dump());
}

// The row of the key for each question and candidate.
struct KeyEntry {
  std::vector<std::string> codes;
  int own = -1;
};

std::map<std::string, KeyEntry> ReadKey(const fs::path& file) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const std::size_t question = csv.RequireColumn("question"),
                    candidate = csv.RequireColumn("candidate"), own = csv.RequireColumn("is_own");
  std::map<std::string, KeyEntry> key;
  while (csv.NextRow()) {
    KeyEntry& entry = key[std::string(csv.Cell(question))];
    if (csv.Number(own) == 1) {
      entry.own = static_cast<int>(entry.codes.size());
    }
    entry.codes.emplace_back(csv.Cell(candidate));
  }
  return key;
}

// The answers of one rater to one question: a rank per candidate of the key, 0 where there is none.
using Ballots = std::map<std::pair<std::string, std::string>, std::vector<int>>;

void AddAnswers(const fs::path& file, const std::map<std::string, KeyEntry>& key,
                Ballots& ballots) {
  const std::string text = ReadFileBytes(file);
  CsvReader csv(text, file.string());
  const std::size_t rater = csv.RequireColumn("rater"), question = csv.RequireColumn("question"),
                    candidate = csv.RequireColumn("candidate"), rank = csv.RequireColumn("rank");
  while (csv.NextRow()) {
    const auto entry = key.find(std::string(csv.Cell(question)));
    if (entry == key.end()) {
      csv.Fail(fmt::format("question '{}' is not in the key; take the key of the same page",
                           csv.Cell(question)));
    }
    const std::vector<std::string>& codes = entry->second.codes;
    const auto code = std::ranges::find(codes, csv.Cell(candidate));
    if (code == codes.end()) {
      csv.Fail(fmt::format("question '{}' has no candidate '{}'; take the key of the same page",
                           csv.Cell(question), csv.Cell(candidate)));
    }
    std::vector<int>& ranks = ballots[{entry->first, std::string(csv.Cell(rater))}];
    ranks.resize(codes.size(), 0);
    int& place = ranks[static_cast<std::size_t>(code - codes.begin())];
    if (place != 0) {
      csv.Fail(fmt::format("rater '{}' ranks candidate '{}' of question '{}' twice; keep one row",
                           csv.Cell(rater), csv.Cell(candidate), csv.Cell(question)));
    }
    const double number = csv.Number(rank);
    if (!(number >= 1 && number <= static_cast<double>(codes.size())) ||
        number != std::floor(number)) {
      csv.Fail(fmt::format("rank {} is not a whole number from 1 to {}", number, codes.size()));
    }
    place = static_cast<int>(number);
  }
}

}  // namespace

RaterPage MakeRaterPage(const RaterPageOptions& options, const RunContext& context) {
  CheckOptions(options);
  const std::vector<RaterFace> faces = ReadFaces(options);
  Random random(options.random_seed);
  const PictureShelf shelf = DrawAll(faces, options.runs.size(), random, context);
  std::vector<std::size_t> asked(options.runs.size());
  std::iota(asked.begin(), asked.end(), 0);
  random.Shuffle(asked);
  Json questions = Json::array();
  CsvWriter key({"question", "candidate", "person", "is_own"});
  for (std::size_t q = 0; q < asked.size(); ++q) {
    const std::size_t own = asked[q];
    const std::string id = fmt::format("q{}", q + 1);
    Json candidates = Json::array();
    for (const std::size_t person : DrawPool(own, faces.size(), options.pool, random)) {
      const std::string code(1, static_cast<char>('a' + candidates.size()));
      candidates.push_back({{"code", code}, {"picture", shelf.Place(person)}});
      key.Row(id, code, faces[person].person, person == own ? 1 : 0);
    }
    questions.push_back({{"id", id},
                         {"face", shelf.Place(faces.size() + own)},
                         {"candidates", std::move(candidates)}});
  }
  const Json data = {{"page", Sha256OfText(questions.dump() + shelf.All().front()).substr(0, 12)},
                     {"seed", static_cast<std::uint32_t>(options.random_seed)},
                     {"pictures", shelf.All()},
                     {"questions", std::move(questions)}};
  return {.html = FilledTemplate(data), .key = key.Text()};
}

std::vector<RaterQuestion> ReadRaterAnswers(const fs::path& key,
                                            const std::vector<fs::path>& answers) {
  const std::map<std::string, KeyEntry> entries = ReadKey(key);
  Ballots ballots;
  for (const fs::path& file : answers) {
    AddAnswers(file, entries, ballots);
  }
  std::map<std::string, RaterQuestion> questions;
  for (const auto& [who, ranks] : ballots) {
    const auto& [question, rater] = who;
    if (std::ranges::find(ranks, 0) != ranks.end()) {
      throw InputError(fmt::format(
          "question '{}': rater '{}' ranks only a part of its {} candidates; leave the answer out",
          question, rater, ranks.size()));
    }
    RaterQuestion& read = questions[question];
    read.name = question;
    read.own = entries.at(question).own;
    read.ranks.push_back(ranks);
  }
  std::vector<RaterQuestion> list;
  for (auto& [name, question] : questions) {
    list.push_back(std::move(question));
  }
  return list;
}

std::string RaterStatisticsCsv(const RaterStatistics& s) {
  CsvWriter csv({"quantity", "value"});
  csv.Row("questions", s.questions);
  csv.Row("answers", s.answers);
  csv.Row("hits", s.hits);
  csv.Row("hit_rate", s.hit_rate);
  csv.Row("hit_rate_95_low", s.hit_95.low);
  csv.Row("hit_rate_95_high", s.hit_95.high);
  csv.Row("chance_hit_rate", s.chance_hit_rate);
  csv.Row("hit_p", s.hit_p);
  csv.Row("mean_rank", s.mean_rank);
  csv.Row("chance_rank", s.chance_rank);
  csv.Row("rank_p", s.rank_p);
  csv.Row("agreement", s.agreement);
  return csv.Text();
}

}  // namespace semblance::problems
