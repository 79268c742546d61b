// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/nifti_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeader1_bytes = 348, kHeader2_bytes = 540;

struct NiftiHeader {
  std::array<double, 8> counts{};                // number of axes, then voxels along each
  std::array<double, 8> sizes{};                 // qfac (-1 or 1), then the size of a voxel
  int datatype = -1;                             // NIfTI's code of the stored type of a voxel
  double voxels_at = kNaN;                       // offset of the voxels, bytes
  double slope = kNaN, intercept = kNaN;         // of the values; a slope of 0 means none
  int qform_code = -1, sform_code = -1;          // > 0: the header has a quaternion, a matrix
  int units = -1, intent = -1;                   // NIfTI's codes
  std::array<double, 3> quaternion{}, offset{};  // b, c, d
  std::array<double, 12> matrix{};               // rows
  bool is_detached = false, is_swapped = false;
};

template <class Value>
Value ValueAt(std::string_view bytes, std::size_t at, bool is_swapped) {
  std::array<char, sizeof(Value)> value{};
  std::memcpy(value.data(), bytes.data() + at, value.size());
  if (is_swapped) {
    std::ranges::reverse(value);
  }
  return std::bit_cast<Value>(value);
}

// Fewer bytes if the file ends before.
std::string ReadFirstBytes(const fs::path& file, std::size_t count) {
  std::string bytes;
  if (IsGzip(file)) {
    Unpack(file, [&](std::string_view block) {
      bytes += block.substr(0, count - bytes.size());
      return bytes.size() < count;
    });
    return bytes;
  }
  bytes.resize(count);
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

// Reads a header whose fields have the type `Real` (float in NIfTI-1, double in NIfTI-2), `Count`
// and `Code` at the given offsets.
struct FieldOffsets {
  std::size_t counts, datatype, sizes, voxels_at, slope, units, intent, codes, quaternion, matrix;
};

template <class Real, class Count, class Code, class Offset>
NiftiHeader ParseFields(std::string_view bytes, const FieldOffsets& at, bool is_swapped) {
  NiftiHeader header{.is_swapped = is_swapped};
  const auto reals = [&](std::size_t from, auto& values) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = ValueAt<Real>(bytes, from + k * sizeof(Real), is_swapped);
    }
  };
  for (std::size_t k = 0; k < header.counts.size(); ++k) {
    header.counts[k] =
        static_cast<double>(ValueAt<Count>(bytes, at.counts + k * sizeof(Count), is_swapped));
  }
  header.datatype = ValueAt<std::int16_t>(bytes, at.datatype, is_swapped);
  header.voxels_at = static_cast<double>(ValueAt<Offset>(bytes, at.voxels_at, is_swapped));
  header.slope = ValueAt<Real>(bytes, at.slope, is_swapped);
  header.intercept = ValueAt<Real>(bytes, at.slope + sizeof(Real), is_swapped);
  header.intent = ValueAt<Code>(bytes, at.intent, is_swapped);
  header.qform_code = ValueAt<Code>(bytes, at.codes, is_swapped);
  header.sform_code = ValueAt<Code>(bytes, at.codes + sizeof(Code), is_swapped);
  reals(at.sizes, header.sizes);
  reals(at.quaternion, header.quaternion);
  reals(at.quaternion + 3 * sizeof(Real), header.offset);
  reals(at.matrix, header.matrix);
  return header;
}

NiftiHeader ParseHeader(std::string_view bytes, const std::string& where) {
  constexpr FieldOffsets kFirst{40, 70, 76, 108, 112, 123, 68, 252, 256, 280};
  constexpr FieldOffsets kSecond{16, 12, 104, 168, 176, 500, 504, 344, 352, 400};
  for (const bool is_swapped : {false, true}) {
    const auto has_size = [&](std::size_t size) {
      return bytes.size() >= size &&
             ValueAt<std::int32_t>(bytes, 0, is_swapped) == static_cast<std::int32_t>(size);
    };
    NiftiHeader header;
    std::string_view mark;
    if (has_size(kHeader1_bytes)) {
      mark = bytes.substr(344, 3);
      header = ParseFields<float, std::int16_t, std::int16_t, float>(bytes, kFirst, is_swapped);
      header.units = static_cast<unsigned char>(bytes[kFirst.units]);
    } else if (has_size(kHeader2_bytes)) {
      mark = bytes.substr(4, 3);
      header =
          ParseFields<double, std::int64_t, std::int32_t, std::int64_t>(bytes, kSecond, is_swapped);
      header.units = ValueAt<std::int32_t>(bytes, kSecond.units, is_swapped);
    } else {
      continue;
    }
    header.is_detached = mark.starts_with("ni");
    if (mark == "n+1" || mark == "ni1" || mark == "n+2" || mark == "ni2") {
      return header;
    }
    throw InputError(fmt::format(
        "{}: its header lacks the mark of NIfTI; an Analyze 7.5 file does not state left and "
        "right, so convert it to NIfTI with a program that knows its source",
        where));
  }
  throw IoError(fmt::format("{}: it is not a NIfTI file, or its header is damaged", where));
}

// ---------------------------------------------------------------------------------------------
// Place
// ---------------------------------------------------------------------------------------------

// From voxels to RAS, in the unit of the header.
struct Form {
  Mat3 steps = Mat3::Constant(kNaN);
  Vec3 origin = Vec3::Constant(kNaN);
};

Vec3 VoxelSize(const NiftiHeader& header) {
  return {header.sizes[1], header.sizes[2], header.sizes[3]};
}

void CheckFinite(const NiftiHeader& header, const std::string& where) {
  constexpr double kMaxCoordinate = 1e9;  // far beyond any head, far below overflow
  const auto check = [&](const auto& values) {
    for (const double value : values) {
      if (!(std::abs(value) <= kMaxCoordinate)) {
        throw InputError(fmt::format(
            "{}: one of the numbers that place its voxels is {}; export it again", where, value));
      }
    }
  };
  check(std::array{header.sizes[1], header.sizes[2], header.sizes[3]});
  if (header.qform_code > 0) {
    check(header.quaternion);
    check(header.offset);
  }
  if (header.sform_code > 0) {
    check(header.matrix);
  }
}

void RequireVoxelSize(const NiftiHeader& header, const std::string& where) {
  const Vec3 size = VoxelSize(header);
  if (!(size.minCoeff() > 0)) {
    throw InputError(fmt::format(
        "{}: its voxels have a size of {} x {} x {} (pixdim in its header), and each must be > 0; "
        "export it again",
        where, size.x(), size.y(), size.z()));
  }
}

Form MakeQform(const NiftiHeader& header, const std::string& where) {
  RequireVoxelSize(header, where);
  const Vec3 bcd(header.quaternion.data());
  const double a = std::sqrt(std::max(0.0, 1 - bcd.squaredNorm()));
  const Eigen::Quaterniond turn(a, bcd.x(), bcd.y(), bcd.z());
  Vec3 size = VoxelSize(header);
  size.z() *= header.sizes[0] < 0 ? -1 : 1;
  return {turn.normalized().toRotationMatrix() * size.asDiagonal(), Vec3(header.offset.data())};
}

Form MakeSform(const NiftiHeader& header) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> rows(header.matrix.data());
  return {rows.leftCols<3>(), rows.col(3)};
}

// The largest distance between the places that two forms give to a corner of the volume.
double LargestDistance(const Form& a, const Form& b, const NiftiHeader& header) {
  double largest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 voxel;
    for (int axis = 0; axis < 3; ++axis) {
      voxel[axis] = (corner >> axis & 1) != 0 ? header.counts[axis + 1] - 1 : 0;
    }
    largest = std::max(largest, ((a.steps - b.steps) * voxel + a.origin - b.origin).norm());
  }
  return largest;
}

double AngleDeg(const Form& a, const Form& b) {
  const Mat3 turn = a.steps.colwise().normalized() * b.steps.colwise().normalized().transpose();
  return std::acos(std::clamp(0.5 * (turn.trace() - 1), -1.0, 1.0)) * 180 / std::numbers::pi;
}

bool SizesAgree(const Vec3& a, const Vec3& b) {
  constexpr double kSameSize = 0.01;  // a share; headers are rounded
  return ((a - b).cwiseAbs().array() <= kSameSize * b.cwiseAbs().array()).all();
}

// The sform, or a reason why it cannot be right in `fault`. Steps of length 1 beside voxels of
// another size are directions, which some programs write; they are multiplied by the size.
Form UsableSform(const NiftiHeader& header, std::string& fault, std::vector<std::string>& notes) {
  Form form = MakeSform(header);
  const Vec3 lengths = form.steps.colwise().norm(), size = VoxelSize(header).cwiseAbs();
  if (size.isZero() || SizesAgree(lengths, size)) {
    return form;
  }
  const std::string words = fmt::format(
      "its sform has steps of {:.4g} x {:.4g} x {:.4g}, and its voxels a size of {:.4g} x {:.4g} x "
      "{:.4g} (pixdim)",
      lengths.x(), lengths.y(), lengths.z(), size.x(), size.y(), size.z());
  if (SizesAgree(lengths, Vec3::Ones()) && size.minCoeff() > 0) {
    form.steps = form.steps * size.asDiagonal();
    notes.push_back(fmt::format("{}: the steps are directions; multiplied by the size", words));
  } else {
    fault = words;
  }
  return form;
}

constexpr int kTalairach = 3;  // this code and larger ones are standard spaces, which scale heads

Form ChooseForm(const NiftiHeader& header, const std::string& where,
                std::vector<std::string>& notes) {
  std::string fault;
  const Form sform = UsableSform(header, fault, notes);
  if (header.qform_code <= 0 && !fault.empty()) {
    throw InputError(fmt::format("{}: {}; correct the wrong one in its header, or export it again",
                                 where, fault));
  }
  if (header.sform_code >= kTalairach) {
    notes.push_back(fmt::format(
        "its sform places the head in a standard space (code {}), {}", header.sform_code,
        header.qform_code > 0 ? "which may scale it; its qform is used"
                              : "and may have scaled it; check the size of the head"));
  } else if (!fault.empty()) {
    notes.push_back(fmt::format("{}, which contradict each other; its qform is used", fault));
  }
  if (header.qform_code <= 0) {
    return sform;
  }
  const Form qform = MakeQform(header, where);
  if (header.sform_code >= kTalairach || !fault.empty()) {
    return qform;
  }
  constexpr double kSamePlace = 0.1;  // voxels
  const double apart = LargestDistance(qform, sform, header);
  if (apart > kSamePlace * VoxelSize(header).minCoeff()) {
    notes.push_back(fmt::format(
        "its qform and sform disagree, by up to {:.4g} (in the file's unit) and {:.1f} deg; the "
        "sform is used: check where the front and the left side of the head are",
        apart, AngleDeg(qform, sform)));
  }
  return sform;
}

// The factor from the header's unit to mm.
double MillimetresPerUnit(int units, std::vector<std::string>& notes) {
  constexpr int kSpace = 7;  // the bits for lengths; others are for time
  switch (units & kSpace) {
    case 0:  // not stated
    case 2:
      return 1;
    case 1:
      notes.emplace_back("the file's lengths are in m; multiplied by 1000 to mm");
      return 1000;
    case 3:
      notes.emplace_back("the file's lengths are in um; multiplied by 0.001 to mm");
      return 0.001;
    default:
      notes.push_back(
          fmt::format("the file's lengths have the unknown unit {}; taken as mm", units & kSpace));
      return 1;
  }
}

void PlaceVoxels(const NiftiHeader& header, const std::string& where, VoxelArray& array) {
  CheckFinite(header, where);
  const double to_mm = MillimetresPerUnit(header.units, array.notes);
  if (header.qform_code <= 0 && header.sform_code <= 0) {
    RequireVoxelSize(header, where);
    array.notes.emplace_back(
        "the file does not state its orientation (its qform_code and sform_code are 0); taken as "
        "LPS");
    array.steps = to_mm * Mat3(VoxelSize(header).asDiagonal());
    array.origin = Vec3::Zero();
    return;
  }
  const Form form =
      header.sform_code > 0 ? ChooseForm(header, where, array.notes) : MakeQform(header, where);
  const Vec3 lps_from_ras(-to_mm, -to_mm, to_mm);
  array.steps = lps_from_ras.asDiagonal() * form.steps;
  array.origin = lps_from_ras.cwiseProduct(form.origin);
}

// ---------------------------------------------------------------------------------------------
// Voxels
// ---------------------------------------------------------------------------------------------

// Calls `visit` with a value of the stored type of a voxel.
template <class Visit>
auto VisitType(int datatype, const std::string& where, const Visit& visit) {
  switch (datatype) {
    case 2:
      return visit(std::uint8_t{});
    case 256:
      return visit(std::int8_t{});
    case 4:
      return visit(std::int16_t{});
    case 512:
      return visit(std::uint16_t{});
    case 8:
      return visit(std::int32_t{});
    case 768:
      return visit(std::uint32_t{});
    case 16:
      return visit(float{});
    case 1024:
      return visit(std::int64_t{});
    case 1280:
      return visit(std::uint64_t{});
    case 64:
      return visit(double{});
    default:
      throw InputError(fmt::format(
          "{}: voxels of NIfTI's type {} (colours, complex numbers or bits) are not read; one real "
          "number per voxel is needed",
          where, datatype));
  }
}

void SetCounts(const NiftiHeader& header, const std::string& where, VoxelArray& array) {
  const auto& [axes, x, y, z, t, u, v, w] = header.counts;
  if (!(axes >= 3 && axes <= 7)) {
    throw InputError(fmt::format("{}: {} axes; a volume has 3", where, axes));
  }
  for (int axis = 4; axis <= static_cast<int>(axes); ++axis) {
    if (header.counts[axis] > 1) {
      throw InputError(fmt::format("{}: {} axes; a volume has 3: choose one of the {} volumes",
                                   where, axes, header.counts[axis]));
    }
  }
  const fs::path voxel_file = NiftiVoxelFile(where);
  const auto size = VisitType(header.datatype, where,
                              [](auto value) { return static_cast<double>(sizeof value); });
  CheckVolumeClaim({.counts = {x, y, z},
                    .bytes_per_voxel = size,
                    .file_bytes = static_cast<double>(fs::file_size(voxel_file))},
                   where);
  array.counts = {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
}

// Reads `count` bytes behind the first `from` bytes. Throws IoError if the file ends before, or if
// it is gzipped and damaged up to there.
std::string ReadVoxelBytes(const fs::path& file, std::size_t from, std::size_t count) {
  // Unpacking this much more reaches the end of the gzip member, and so verifies its checksum.
  constexpr std::size_t kEndOfMember_bytes = 1 << 20;
  std::string bytes;
  if (IsGzip(file)) {
    bytes.reserve(count);
    std::size_t passed = 0;
    Unpack(file, [&](std::string_view block) {
      const std::size_t skipped = std::min(block.size(), from - std::min(from, passed));
      passed += block.size();
      bytes += block.substr(skipped, count - bytes.size());
      return passed <= from + count + kEndOfMember_bytes;
    });
  } else if (static_cast<std::size_t>(fs::file_size(file)) >= from + count) {
    bytes.resize(count);
    std::ifstream in(file, std::ios::binary);
    in.seekg(static_cast<std::streamoff>(from));
    in.read(bytes.data(), static_cast<std::streamsize>(count));
    bytes.resize(static_cast<std::size_t>(in.gcount()));
  }
  if (bytes.size() < count) {
    throw IoError(fmt::format(
        "{}: the file is cut short: {} bytes of voxels are needed; copy or export it again",
        file.string(), count));
  }
  return bytes;
}

void AppendVoxels(const NiftiHeader& header, const std::string& where, VoxelArray& array) {
  const bool is_scaled = std::isfinite(header.slope) && header.slope != 0;
  if (is_scaled && !std::isfinite(header.intercept)) {
    throw InputError(fmt::format("{}: its scl_inter is {}, which is no intercept; export it again",
                                 where, header.intercept));
  }
  const double slope = is_scaled ? header.slope : 1, intercept = is_scaled ? header.intercept : 0;
  const std::size_t voxels = static_cast<std::size_t>(array.counts[0]) * array.counts[1] *
                             static_cast<std::size_t>(array.counts[2]);
  // std::max returns the minimum if the stored offset is not a number.
  constexpr double kMaxOffset = 1e9;
  const double least = header.is_detached ? 0.0 : static_cast<double>(kHeader1_bytes);
  const auto from =
      static_cast<std::size_t>(std::min(kMaxOffset, std::max(least, header.voxels_at)));
  VisitType(header.datatype, where, [&]<class Value>(Value) {
    const std::string bytes = ReadVoxelBytes(NiftiVoxelFile(where), from, voxels * sizeof(Value));
    array.values.reserve(voxels);
    for (std::size_t n = 0; n < voxels; ++n) {
      const auto stored = ValueAt<Value>(bytes, n * sizeof(Value), header.is_swapped);
      AppendRounded(slope * static_cast<double>(stored) + intercept, array);
    }
  });
}

}  // namespace

fs::path NiftiVoxelFile(const fs::path& file) {
  if (LowerCase(file.extension().string()) != ".hdr") {
    return file;
  }
  for (const char* ending : {".img", ".img.gz", ".IMG"}) {
    const fs::path image = fs::path(file).replace_extension(ending);
    if (fs::exists(image)) {
      return image;
    }
  }
  throw IoError(fmt::format("{}: the file {} with its voxels is missing; put it beside the header",
                            file.string(), fs::path(file).replace_extension(".img").string()));
}

VoxelArray ReadNifti(const fs::path& file) {
  const std::string where = file.string();
  const NiftiHeader header = ParseHeader(ReadFirstBytes(file, kHeader2_bytes), where);
  if (header.is_detached != (NiftiVoxelFile(file) != file)) {
    throw InputError(fmt::format(
        "{}: its header says that the voxels are in {}; name the pair NAME.hdr and NAME.img, or "
        "the single file NAME.nii",
        where, header.is_detached ? "another file" : "the same file"));
  }
  VoxelArray array;
  SetCounts(header, where, array);
  PlaceVoxels(header, where, array);
  if (header.intent != 0) {
    array.notes.push_back(fmt::format(
        "its intent_code is {}, so its values may be results (labels, statistics) rather than a "
        "scan's",
        header.intent));
  }
  AppendVoxels(header, where, array);
  return array;
}

}  // namespace semblance::problems
