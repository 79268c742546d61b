// SPDX-License-Identifier: GPL-3.0-or-later
// Laws of the contents of inputs, over every option that names a file.
#include "problems/experiment/input_contents.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using testing::ScratchFolder;
using ::testing::SizeIs;

std::vector<ConfigNode> TreesNaming(const ConfigType& type, const std::string& file);

std::vector<ConfigNode> TreesNaming(const std::vector<ConfigField>& fields, const ConfigNode& map,
                                    const std::string& file) {
  std::vector<ConfigNode> trees;
  for (const ConfigField& field : fields) {
    for (const ConfigNode& value : TreesNaming(field.type, file)) {
      trees.push_back(map);
      trees.back().Set(field.info.name, value);
    }
  }
  return trees;
}

// Trees of the type that each set one option to the path of a file; one per such option.
std::vector<ConfigNode> TreesNaming(const ConfigType& type, const std::string& file) {
  using Kind = ConfigType::Kind;
  std::vector<ConfigNode> trees;
  if (type.kind == Kind::kPath) {
    trees = {ConfigNode::Quoted(file)};
  } else if (type.kind == Kind::kStruct) {
    trees = TreesNaming(type.fields, ConfigNode::Map(), file);
  } else if (type.kind == Kind::kVariant) {
    for (const ConfigAlternative& alternative : type.alternatives) {
      ConfigNode map = ConfigNode::Map();
      map.Set("type", ConfigNode::Quoted(alternative.name));
      std::ranges::move(TreesNaming(alternative.fields, map, file), std::back_inserter(trees));
    }
  } else if (!type.inner.empty()) {
    for (const ConfigNode& value : TreesNaming(type.inner[0], file)) {
      ConfigNode node = type.kind == Kind::kMap        ? ConfigNode::Map()
                        : type.kind == Kind::kOptional ? value
                                                       : ConfigNode::List();
      if (type.kind == Kind::kMap) {
        node.Set("key", value);
      } else if (type.kind != Kind::kOptional) {
        node.items.assign(std::max<std::size_t>(1, type.size), value);
      }
      trees.push_back(node);
    }
  }
  return trees;
}

// The experiments that each name the file in one option.
std::vector<Experiment> ExperimentsNaming(const fs::path& file) {
  std::vector<Experiment> experiments;
  for (const ConfigNode& tree : TreesNaming(DescribeExperiment(), file.string())) {
    ConfigErrors contradictions;  // with options that are not set
    experiments.push_back(ReadConfigTree<Experiment>(tree, contradictions));
  }
  return experiments;
}

std::string Identity(const Experiment& experiment) {
  FileHashes hashes;
  return ToFlowYaml(WithInputs(MakeConfigTree(experiment), NamedFiles(experiment),
                               [&](const NamedFile& input) { return HashContent(input, hashes); }));
}

TEST(InputContents, EveryOptionThatNamesAFileCountsByItsContentAlone) {
  const ScratchFolder folder;
  const fs::path here = folder / "a.ply", there = folder / "other folder/b.ply";
  fs::create_directories(there.parent_path());
  const std::vector<Experiment> experiments = ExperimentsNaming(here),
                                moved = ExperimentsNaming(there);
  EXPECT_GT(experiments.size(), 15U);
  for (std::size_t n = 0; n < experiments.size(); ++n) {
    const std::vector<NamedFile> named = NamedFiles(experiments[n]);
    const auto input = std::ranges::find(named, here, &NamedFile::file);
    ASSERT_NE(input, named.end()) << n;
    WriteFileAtomically(here, "content");
    const std::string before = Identity(experiments[n]);
    WriteFileAtomically(there, "content");
    EXPECT_EQ(Identity(moved[n]), before) << input->option;
    WriteFileAtomically(here, "contenu");
    const std::string after = Identity(experiments[n]);
    EXPECT_NE(after, before) << input->option;
    fs::remove(here);
    EXPECT_NE(Identity(experiments[n]), before) << input->option;
    EXPECT_NE(Identity(experiments[n]), after) << input->option;
  }
}

TEST(InputContents, EqualContentsUnderOtherOptionsDiffer) {
  const ScratchFolder folder;
  const fs::path file = folder / "a.ply";
  WriteFileAtomically(file, "content");
  std::vector<std::string> identities;
  for (const Experiment& experiment : ExperimentsNaming(file)) {
    identities.push_back(Identity(experiment));
  }
  std::ranges::sort(identities);
  EXPECT_EQ(std::ranges::adjacent_find(identities), identities.end());
}

// A text replacement would find one path within another one, and an escaped path nowhere.
TEST(InputContents, NoNameIsMistakenForAnother) {
  const ScratchFolder folder;
  for (const auto& [skull, landmarks] :
       std::vector<std::pair<std::string, std::string>>{{"skull.ply", "skull.ply.yaml"},
                                                        {"ct", "ct_landmarks.yaml"},
                                                        {"a \"b\".ply", "l \"m\".yaml"},
                                                        {"a\\b.ply", "l\\m.yaml"},
                                                        {"it's # one.ply", "%ü: [1].yaml"}}) {
    FileSubject files;
    files.skull = folder / skull;
    files.landmarks = folder / landmarks;
    Experiment experiment;
    experiment.subject = files;
    WriteFileAtomically(files.skull, "s");
    WriteFileAtomically(files.landmarks, "l");
    const std::string before = Identity(experiment);
    EXPECT_EQ(before.find(folder.Path().string()), before.npos) << skull;
    WriteFileAtomically(files.landmarks, "m");
    EXPECT_NE(Identity(experiment), before) << landmarks;
    WriteFileAtomically(files.landmarks, "s");
    WriteFileAtomically(files.skull, "l");
    EXPECT_NE(Identity(experiment), before) << "exchanged";
    WriteFileAtomically(files.landmarks, "l");
    WriteFileAtomically(files.skull, "s");
    EXPECT_EQ(Identity(experiment), before);
  }
}

class Parts : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, text);
  }
  // Each of the files is a part of the input: a changed byte changes the hash, and so does its
  // loss.
  void ExpectParts(const NamedFile& input, const std::vector<std::string>& names) const {
    std::vector<fs::path> parts;
    for (const std::string& name : names) {
      parts.push_back(folder_ / name);
    }
    EXPECT_THAT(ListParts(input), ::testing::UnorderedElementsAreArray(parts));
    FileHashes hashes;
    const std::string before = HashContent(input, hashes);
    for (const fs::path& part : parts) {
      const std::string bytes = ReadFileBytes(part);
      WriteFileAtomically(part, bytes + " ");
      EXPECT_NE(HashContent(input, hashes), before) << part;
      WriteFileAtomically(part, bytes);
      EXPECT_EQ(HashContent(input, hashes), before) << part;
    }
  }
  NamedFile Volume(const char* name) const { return {"subject.volume", folder_ / name}; }

  ScratchFolder folder_;
};

TEST_F(Parts, AHeaderComesWithItsVoxels) {
  for (const char* name : {"h.raw", "one 1.raw", "s007.raw", "s008.raw", "s009.raw", "h.img"}) {
    Write(name, "voxels");
  }
  Write("h.mhd", "NDims = 3\r\nElementDataFile = h.raw\r\n");
  ExpectParts(Volume("h.mhd"), {"h.mhd", "h.raw"});
  Write("blank.mha", "NDims = 3\nElementDataFile = one 1.raw\n");
  ExpectParts(Volume("blank.mha"), {"blank.mha", "one 1.raw"});
  Write("list.mhd", "NDims = 3\nElementDataFile = LIST\ns007.raw\ns009.raw\n");
  ExpectParts(Volume("list.mhd"), {"list.mhd", "s007.raw", "s009.raw"});
  Write("pattern.mhd", "ElementDataFile = s%03d.raw 7 9 1\n");
  ExpectParts(Volume("pattern.mhd"), {"pattern.mhd", "s007.raw", "s008.raw", "s009.raw"});
  Write("whole.mha", "NDims = 3\nElementDataFile = LOCAL\nElementDataFile = h.raw\n");
  ExpectParts(Volume("whole.mha"), {"whole.mha"});
  Write("h.nhdr", "NRRD0004\ntype: short\ndata file: h.raw\n\n");
  ExpectParts(Volume("h.nhdr"), {"h.nhdr", "h.raw"});
  Write("list.nhdr", "NRRD0004\ndatafile: LIST 2\ns007.raw\ns009.raw\n");
  ExpectParts(Volume("list.nhdr"), {"list.nhdr", "s007.raw", "s009.raw"});
  Write("pattern.nhdr", "NRRD0004\ndata file: s%03d.raw 9 7 -2\n\n");
  ExpectParts(Volume("pattern.nhdr"), {"pattern.nhdr", "s007.raw", "s009.raw"});
  Write("whole.nrrd", "NRRD0004\ntype: short\n\ndata file: h.raw\n");
  ExpectParts(Volume("whole.nrrd"), {"whole.nrrd"});
  Write("h.hdr", "header");
  ExpectParts(Volume("h.hdr"), {"h.hdr", "h.img"});
}

TEST_F(Parts, MissingVoxelsAreListed) {
  Write("h.mhd", "ElementDataFile = h.raw\n");
  EXPECT_THAT(ListParts(Volume("h.mhd")), ElementsAre(folder_ / "h.mhd", folder_ / "h.raw"));
  Write("many.mhd", "ElementDataFile = s%d.raw 1 999999999999 1\n");
  EXPECT_THAT(ListParts(Volume("many.mhd")), SizeIs(100'001)) << "a hostile header ends";
}

TEST_F(Parts, AFolderCountsWithAllItsFilesButNotWithItsPlace) {
  Write("ct/1.dcm", "one");
  Write("ct/more/2.dcm", "two");
  ExpectParts(Volume("ct"), {"ct/1.dcm", "ct/more/2.dcm"});
  FileHashes hashes;
  const std::string before = HashContent(Volume("ct"), hashes);
  fs::rename(folder_ / "ct", folder_ / "moved");
  EXPECT_EQ(HashContent(Volume("moved"), hashes), before);
  Write("moved/3.dcm", "");
  EXPECT_NE(HashContent(Volume("moved"), hashes), before);
}

TEST_F(Parts, ATableComesWithItsBases) {
  Write("deep/base.yaml", "base: ../root.yaml\n");
  Write("root.yaml", "base: [table.yaml, gone.yaml]\n");
  Write("gone.yaml", "");
  Write("table.yaml", "id: t\n\"base\": deep/base.yaml\n");
  ExpectParts({"tissue.table", folder_ / "table.yaml"},
              {"table.yaml", "deep/base.yaml", "root.yaml", "gone.yaml"});
}

TEST_F(Parts, ABustComesWithItsMaterialsAndTextures) {
  Write("head.obj", "mtllib head.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl skin\nf 1 2 3\n");
  Write("head.mtl", "newmtl skin\nmap_Kd tex/skin.png\n");
  Write("tex/skin.png", std::string("\x89PNG\r\n\x1a\n", 8) + std::string(100, 'x'));
  ExpectParts({"bust.mesh", folder_ / "head.obj"}, {"head.obj", "head.mtl", "tex/skin.png"});
}

}  // namespace
}  // namespace semblance::problems
