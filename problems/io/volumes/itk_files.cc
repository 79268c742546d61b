// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/itk_files.h"

// Must come first: ITK's headers otherwise include parts of an older Eigen of their own.
#include <Eigen/Dense>

#include <fmt/format.h>
#include <gdcmImageWriter.h>
#include <gdcmMediaStorage.h>
#include <gdcmPixmapReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <array>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <locale>
#include <set>
#include <sstream>

#include "problems/io/volumes/dicom_series.h"
#include "problems/io/volumes/volume_headers.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Both libraries print their errors to the terminal, and parse and write numbers as the locale has
// them: in a locale with decimal commas they would read 2.5 as 2. An object of this class silences
// them and keeps the locale "C" as long as it exists.
class LibraryScope {
 public:
  LibraryScope() : before_(std::locale::global(std::locale::classic())) {
    const char* const numeric = std::setlocale(LC_NUMERIC, nullptr);
    numeric_before_ = numeric ? numeric : "C";
    std::setlocale(LC_NUMERIC, "C");
    itk::Object::SetGlobalWarningDisplay(false);
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
  }
  ~LibraryScope() {
    std::locale::global(before_);
    std::setlocale(LC_NUMERIC, numeric_before_.c_str());
  }
  LibraryScope(const LibraryScope&) = delete;
  LibraryScope& operator=(const LibraryScope&) = delete;

 private:
  std::locale before_;
  std::string numeric_before_;
};

// The last sentence of ITK's message, without the address of an object in memory.
std::string ErrorText(const itk::ExceptionObject& error) {
  std::string words = error.GetDescription();
  const std::size_t address = words.find("): ");
  words = address == words.npos ? words : words.substr(address + 3);
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

// Values that become slope * value + intercept.
struct Rescale {
  double slope = 1, intercept = 0;
};

template <class Value>
void AppendScaled(const void* buffer, std::size_t count, const Rescale& rescale,
                  VoxelArray& array) {
  const Value* const values = static_cast<const Value*>(buffer);
  for (std::size_t n = 0; n < count; ++n) {
    AppendRounded(rescale.slope * static_cast<double>(values[n]) + rescale.intercept, array);
  }
}

void AppendScaled(const itk::ImageIOBase& io, const void* buffer, std::size_t count,
                  const Rescale& rescale, VoxelArray& array, const std::string& where) {
  using Type = itk::IOComponentEnum;
  switch (io.GetComponentType()) {
    case Type::UCHAR:
      return AppendScaled<unsigned char>(buffer, count, rescale, array);
    case Type::CHAR:
      return AppendScaled<signed char>(buffer, count, rescale, array);
    case Type::USHORT:
      return AppendScaled<unsigned short>(buffer, count, rescale, array);
    case Type::SHORT:
      return AppendScaled<short>(buffer, count, rescale, array);
    case Type::UINT:
      return AppendScaled<unsigned int>(buffer, count, rescale, array);
    case Type::INT:
      return AppendScaled<int>(buffer, count, rescale, array);
    case Type::ULONG:
      return AppendScaled<unsigned long>(buffer, count, rescale, array);
    case Type::LONG:
      return AppendScaled<long>(buffer, count, rescale, array);
    case Type::FLOAT:
      return AppendScaled<float>(buffer, count, rescale, array);
    case Type::DOUBLE:
      return AppendScaled<double>(buffer, count, rescale, array);
    default:
      throw InputError(
          fmt::format("{}: voxels of type '{}' are not read", where,
                      itk::ImageIOBase::GetComponentTypeAsString(io.GetComponentType())));
  }
}

// Appends all voxels of the file. Throws unless their number is as expected.
void AppendVoxels(itk::ImageIOBase& io, std::size_t expected, const Rescale& rescale,
                  VoxelArray& array, const std::string& where) {
  if (io.GetNumberOfComponents() != 1) {
    throw InputError(fmt::format("{}: {} values per voxel (colours, vectors); one is needed", where,
                                 io.GetNumberOfComponents()));
  }
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io.GetDimensions(axis));
  }
  io.SetIORegion(region);
  const auto count = static_cast<std::size_t>(io.GetImageSizeInPixels());
  if (count != expected) {
    throw InputError(fmt::format("{}: {} voxels instead of {}", where, count, expected));
  }
  // Not every library reports a short file; some leave the end of the buffer as it is. No scanner
  // writes 1024 equal bytes of this value.
  constexpr char kUntouched = 0x5a;
  constexpr std::size_t kTail = 1024;
  std::vector<char> buffer(static_cast<std::size_t>(io.GetImageSizeInBytes()), kUntouched);
  io.Read(buffer.data());
  const auto tail = buffer.end() - static_cast<std::ptrdiff_t>(std::min(kTail, buffer.size()));
  if (std::all_of(tail, buffer.end(), [](char byte) { return byte == kUntouched; })) {
    throw IoError(fmt::format("{}: the file is cut short; copy or export it again", where));
  }
  AppendScaled(io, buffer.data(), count, rescale, array, where);
}

struct Reader {
  itk::ImageIOBase::Pointer io;
  const char* name;
};

Reader MakeReader(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::kNifti:  // is written only
      return {itk::NiftiImageIO::New().GetPointer(), "NIfTI"};
    case VolumeFormat::kNrrd:
      return {itk::NrrdImageIO::New().GetPointer(), "NRRD"};
    default:
      return {itk::MetaImageIO::New().GetPointer(), "MetaImage"};
  }
}

// Called before memory is allocated for the voxels.
void CheckClaim(const itk::ImageIOBase& io, const std::filesystem::path& file) {
  VolumeClaim claim{.counts = {1, 1, 1},
                    .bytes_per_voxel = static_cast<double>(io.GetComponentSize()),
                    .file_bytes = HasDetachedVoxels(file)
                                      ? kNaN
                                      : static_cast<double>(std::filesystem::file_size(file))};
  for (unsigned axis = 0; axis < std::min(3U, io.GetNumberOfDimensions()); ++axis) {
    claim.counts[axis] = static_cast<double>(io.GetDimensions(axis));
  }
  CheckVolumeClaim(claim, file.string());
}

// Reads counts, origin and steps. ITK provides them in LPS and mm for every format.
VoxelArray ReadGeometry(const itk::ImageIOBase& io, const std::filesystem::path& file) {
  const std::string where = file.string();
  const unsigned axes = io.GetNumberOfDimensions();
  for (unsigned axis = 3; axis < axes; ++axis) {
    if (io.GetDimensions(axis) != 1) {
      throw InputError(fmt::format("{}: {} axes; a volume has 3: choose one of the {} volumes",
                                   where, axes, io.GetDimensions(axis)));
    }
  }
  if (axes < 3) {
    throw InputError(fmt::format("{}: {} axes; a volume has 3", where, axes));
  }
  CheckClaim(io, file);
  VoxelArray array;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(io.GetSpacing(axis) > 0)) {
      throw InputError(fmt::format("{}: a spacing of {} mm is not usable; each must be > 0", where,
                                   io.GetSpacing(axis)));
    }
    array.counts[axis] = static_cast<int>(io.GetDimensions(axis));
    array.origin[axis] = io.GetOrigin(axis);
    const std::vector<double> direction = io.GetDirection(axis);
    array.steps.col(axis) = io.GetSpacing(axis) * Vec3(direction[0], direction[1], direction[2]);
  }
  return array;
}

std::string ReadHead(const std::filesystem::path& file, std::uintmax_t max_bytes = 4096) {
  std::ifstream in(file, std::ios::binary);
  std::string head(std::min(std::filesystem::file_size(file), max_bytes), ' ');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head;
}

// The library of MetaImage does not report a file that ends too early; that of NRRD does. The size
// shows it if the MetaImage is one file and not compressed.
void CheckMetaImageWhole(const std::filesystem::path& file, std::uintmax_t needed) {
  const std::string head = ReadHead(file);
  const std::size_t local = head.find("LOCAL");
  if (local == head.npos || IsCompressedMetaImage(head)) {
    return;
  }
  if (std::filesystem::file_size(file) < needed + head.find('\n', local) + 1) {
    throw IoError(fmt::format(
        "{}: the file is cut short: {} bytes of voxels are needed; copy or export it again",
        file.string(), needed));
  }
}

std::size_t VoxelCount(const VoxelArray& array) {
  return static_cast<std::size_t>(array.counts[0]) * array.counts[1] * array.counts[2];
}

namespace tags {
const gdcm::Tag kCharacters(0x0008, 0x0005);
const gdcm::Tag kImageType(0x0008, 0x0008), kSopClass(0x0008, 0x0016), kSopInstance(0x0008, 0x0018);
const gdcm::Tag kStudyDate(0x0008, 0x0020), kStudyTime(0x0008, 0x0030);
const gdcm::Tag kModality(0x0008, 0x0060), kDescription(0x0008, 0x103e), kPatient(0x0010, 0x0010);
const gdcm::Tag kPatientId(0x0010, 0x0020), kBirthDate(0x0010, 0x0030), kThickness(0x0018, 0x0050);
const gdcm::Tag kTilt(0x0018, 0x1120), kPatientPosition(0x0018, 0x5100), kStudy(0x0020, 0x000d);
const gdcm::Tag kSeries(0x0020, 0x000e), kSeriesNumber(0x0020, 0x0011), kInstance(0x0020, 0x0013);
const gdcm::Tag kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037), kFrame(0x0020, 0x0052);
const gdcm::Tag kSamples(0x0028, 0x0002), kFrames(0x0028, 0x0008), kRows(0x0028, 0x0010);
const gdcm::Tag kColumns(0x0028, 0x0011), kSpacing(0x0028, 0x0030), kBits(0x0028, 0x0100);
const gdcm::Tag kIntercept(0x0028, 0x1052), kSlope(0x0028, 0x1053), kValueTable(0x0028, 0x3000);
const gdcm::Tag kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230);
const gdcm::Tag kPixels(0x7fe0, 0x0010);
// The groups of an enhanced image that hold these tags.
const gdcm::Tag kPlacePosition(0x0020, 0x9113), kPlaceOrientation(0x0020, 0x9116);
const gdcm::Tag kMeasures(0x0028, 0x9110), kTransformation(0x0028, 0x9145);
}  // namespace tags

std::string Text(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  const gdcm::ByteValue* const value =
      data.FindDataElement(tag) ? data.GetDataElement(tag).GetByteValue() : nullptr;
  constexpr std::string_view kPadding(" \0", 2);
  std::string_view text;
  if (value) {
    text = {value->GetPointer(), static_cast<std::size_t>(value->GetLength())};
  }
  text.remove_prefix(std::min(text.size(), text.find_first_not_of(kPadding)));
  return std::string(text.substr(0, text.find_last_not_of(kPadding) + 1));
}

int UnsignedShort(const gdcm::DataSet& data, const gdcm::Tag& tag, int otherwise) {
  const gdcm::ByteValue* const value =
      data.FindDataElement(tag) ? data.GetDataElement(tag).GetByteValue() : nullptr;
  std::uint16_t number = 0;
  if (!value || !value->GetBuffer(reinterpret_cast<char*>(&number), sizeof number)) {
    return otherwise;
  }
  return number;
}

int Integer(const std::string& text, int otherwise) {
  constexpr double kMaxInteger = 1e9;  // larger numbers do not fit an int
  const std::vector<double> number = ParseDecimals(text).numbers;
  return number.size() != 1 || !(std::abs(number[0]) <= kMaxInteger) ? otherwise
                                                                     : static_cast<int>(number[0]);
}

// The tags of one image of a file. An enhanced file keeps them in groups of each image, or in
// groups that all images share; other files keep them in the data set itself.
class ImageTags {
 public:
  explicit ImageTags(const gdcm::DataSet& data)
      : data_(&data),
        shared_(Sequence(data, tags::kSharedGroups)),
        frames_(Sequence(data, tags::kFrameGroups)) {}

  int PlacedFrames() const { return frames_ ? static_cast<int>(frames_->GetNumberOfItems()) : 0; }
  std::string Find(int frame, const gdcm::Tag& group, const gdcm::Tag& tag) const {
    for (const auto& [sequence, item] : {std::pair(frames_, frame), std::pair(shared_, 0)}) {
      const std::string text = InGroup(sequence, item, group, tag);
      if (!text.empty()) {
        return text;
      }
    }
    return Text(*data_, tag);
  }

 private:
  using Items = gdcm::SmartPointer<gdcm::SequenceOfItems>;
  static Items Sequence(const gdcm::DataSet& data, const gdcm::Tag& tag) {
    return data.FindDataElement(tag) ? data.GetDataElement(tag).GetValueAsSQ() : Items();
  }
  static std::string InGroup(const Items& sequence, int item, const gdcm::Tag& group,
                             const gdcm::Tag& tag) {
    const auto has = [](const Items& items, int index) {
      return items && static_cast<int>(items->GetNumberOfItems()) > index;
    };
    if (!has(sequence, item)) {
      return "";
    }
    const Items members = Sequence(sequence->GetItem(item + 1).GetNestedDataSet(), group);
    return has(members, 0) ? Text(members->GetItem(1).GetNestedDataSet(), tag) : "";
  }

  const gdcm::DataSet* data_;
  Items shared_, frames_;
};

// The numbers of a tag. Sets the header's fault if they are no numbers, or not as many as expected.
std::vector<double> Numbers(const std::string& name, const std::string& text, std::size_t expected,
                            DicomHeader& header) {
  if (text.empty()) {
    return {};
  }
  const Decimals decimals = ParseDecimals(text);
  if (decimals.numbers.size() != expected) {
    AddWords(fmt::format("{} is '{}', which is not {}", name, CleanDicomText(text),
                         expected == 1 ? "a number" : fmt::format("{} numbers", expected)),
             header.fault);
    return {};
  }
  if (decimals.has_comma && header.comma.empty()) {
    header.comma = fmt::format("{} '{}'", name, CleanDicomText(text));
  }
  return decimals.numbers;
}

double Number(const std::string& name, const std::string& text, DicomHeader& header) {
  const std::vector<double> number = Numbers(name, text, 1, header);
  return number.empty() ? kNaN : number[0];
}

void SetPlace(const ImageTags& image, DicomHeader& header) {
  const std::string position = image.Find(header.frame, tags::kPlacePosition, tags::kPosition);
  const std::string orientation =
      image.Find(header.frame, tags::kPlaceOrientation, tags::kOrientation);
  const std::string spacing = image.Find(header.frame, tags::kMeasures, tags::kSpacing);
  const auto p = Numbers(kPositionTag, position, 3, header);
  const auto o = Numbers(kOrientationTag, orientation, 6, header);
  const auto s = Numbers(kSpacingTag, spacing, 2, header);
  if (!p.empty()) {
    header.position = Vec3(p[0], p[1], p[2]);
  }
  if (!o.empty()) {
    header.along_columns = Vec3(o[0], o[1], o[2]);
    header.along_rows = Vec3(o[3], o[4], o[5]);
  }
  if (!s.empty()) {
    header.spacing_mm = Vec2(s[1], s[0]);  // the tag has the spacing between rows first
  }
  for (const auto& [name, text] :
       {std::pair(kPositionTag, position), std::pair(kOrientationTag, orientation),
        std::pair(kSpacingTag, spacing)}) {
    if (text.empty()) {
      AddWords(name, header.lacking);
    }
  }
  CheckSlicePlace(header);
}

void SetValues(const gdcm::DataSet& data, const ImageTags& image, DicomHeader& header) {
  header.slope =
      Number(kSlopeTag, image.Find(header.frame, tags::kTransformation, tags::kSlope), header);
  header.intercept = Number(
      kInterceptTag, image.Find(header.frame, tags::kTransformation, tags::kIntercept), header);
  header.thickness_mm = Number("Slice Thickness (0018,0050)",
                               image.Find(header.frame, tags::kMeasures, tags::kThickness), header);
  header.tilt_deg = Number("Gantry/Detector Tilt (0018,1120)", Text(data, tags::kTilt), header);
  if (data.FindDataElement(tags::kValueTable)) {
    AddWords("its values are in a Modality LUT Sequence (0028,3000), which is not read",
             header.fault);
  }
}

// The tags that all images of a file share.
DicomHeader MakeHeader(const std::filesystem::path& file, const gdcm::DataSet& data) {
  const auto text = [&](const gdcm::Tag& tag) { return Text(data, tag); };
  DicomHeader header;
  header.file = file;
  header.characters = text(tags::kCharacters);
  header.series_uid = text(tags::kSeries);
  header.series_number = text(tags::kSeriesNumber);
  header.description = text(tags::kDescription);
  header.modality = text(tags::kModality);
  header.image_type = text(tags::kImageType);
  header.patient_id = text(tags::kPatientId);
  header.patient_name = text(tags::kPatient);
  header.birth_date = text(tags::kBirthDate);
  header.space_uid = text(tags::kFrame);
  header.instance = Integer(text(tags::kInstance), -1);
  header.rows = UnsignedShort(data, tags::kRows, -1);
  header.columns = UnsignedShort(data, tags::kColumns, -1);
  header.frames = std::max(1, Integer(text(tags::kFrames), 1));
  return header;
}

// ---------------------------------------------------------------------------------------------
// The bytes of pixels. GDCM fills those that a file lacks with 0, which is soft tissue.
// ---------------------------------------------------------------------------------------------

std::uint32_t LittleEndian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < sizeof value; ++k) {
    value |= std::uint32_t{static_cast<unsigned char>(bytes[at + k])} << (8 * k);
  }
  return value;
}

std::string ReadBytes(std::istream& in, std::streamoff from, std::size_t count) {
  std::string bytes(count, '\0');
  in.clear();
  in.seekg(from);
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

// True if the stream stands behind the tag and the length of the pixels. Sets their length.
bool IsAtPixels(std::istream& in, std::streamoff at, std::uint32_t& length) {
  constexpr std::size_t kHead_bytes = 12;  // the longest form of an element's tag and length
  const std::string head =
      ReadBytes(in, at - static_cast<std::streamoff>(kHead_bytes), kHead_bytes);
  if (head.size() < kHead_bytes) {
    return false;
  }
  constexpr std::string_view kLittle("\xe0\x7f\x10\x00", 4), kBig("\x7f\xe0\x00\x10", 4);
  length = LittleEndian(head, 8);
  if (head.starts_with(kBig)) {
    length = __builtin_bswap32(length);
  }
  return head.starts_with(kLittle) || head.starts_with(kBig) || head.substr(4, 4) == kLittle;
}

constexpr std::uint32_t kUnknownLength = 0xffffffff;

// A fault of compressed pixels: they are items, each with its length, and end with a mark.
std::string FaultOfItems(std::istream& in, std::streamoff at, std::streamoff end) {
  constexpr std::uint32_t kItem = 0xe000fffe, kEnd = 0xe0ddfffe;
  while (at + 8 <= end) {
    const std::string head = ReadBytes(in, at, 8);
    if (LittleEndian(head, 0) == kEnd) {
      return "";
    }
    if (LittleEndian(head, 0) != kItem) {
      return "its compressed pixels are damaged";
    }
    at += 8 + static_cast<std::streamoff>(LittleEndian(head, 4));
  }
  return "it ends within its compressed pixels";
}

// The bytes that uncompressed pixels need.
double PixelBytes(const gdcm::DataSet& data, const DicomHeader& header) {
  return std::ceil(static_cast<double>(header.rows) * header.columns * header.frames *
                   UnsignedShort(data, tags::kSamples, 1) * UnsignedShort(data, tags::kBits, 16) /
                   8);
}

std::string FaultOfPixels(std::istream& in, std::streamoff at, std::uint32_t length,
                          double needed) {
  in.clear();
  in.seekg(0, std::ios::end);
  const std::streamoff end = in.tellg();
  if (length == kUnknownLength) {
    return FaultOfItems(in, at, end);
  }
  const double present = std::min<double>(length, static_cast<double>(end - at));
  if (present < std::max<double>(length, needed)) {
    return fmt::format("it holds {:.0f} of the {:.0f} bytes of its pixels", present,
                       std::max<double>(length, needed));
  }
  return "";
}

// True for a stored file without its first 132 bytes (the last four are "DICM"): it begins with
// elements of group 2 or 8 in ascending order.
bool IsBareDataSet(std::string_view head) {
  constexpr std::size_t kElements = 2;
  std::size_t at = 0;
  std::uint32_t before = 0;
  for (std::size_t n = 0; n < kElements; ++n) {
    if (at + 8 > head.size()) {
      return false;
    }
    const std::uint32_t stored = LittleEndian(head, at), tag = (stored << 16) | (stored >> 16);
    const std::uint32_t group = tag >> 16;
    const bool has_type = std::isupper(static_cast<unsigned char>(head[at + 4])) != 0 &&
                          std::isupper(static_cast<unsigned char>(head[at + 5])) != 0;
    const std::uint32_t length =
        has_type ? LittleEndian(head, at + 4) >> 16 : LittleEndian(head, at + 4);
    if ((group != 2 && group != 8) || tag < before || length > head.size()) {
      return false;
    }
    before = tag + 1;
    at += 8 + length;
  }
  return true;
}

// True for a file that begins like DICOM and is not the table of contents of a disc. GDCM would
// scan other files too, and some of them end the program.
bool CanBeSlice(const std::filesystem::path& file) {
  if (file.filename().string().starts_with("DICOMDIR")) {
    return false;
  }
  const std::string head = ReadHead(file);
  return (head.size() >= 132 && std::string_view(head).substr(128, 4) == "DICM") ||
         IsBareDataSet(head);
}

// Reads the tags before the pixels. Returns false if they are damaged.
bool ReadTags(std::istream& in, gdcm::Reader& reader) try {
  reader.SetStream(in);
  return reader.ReadUpToTag(tags::kPixels, {tags::kPixels});
} catch (const std::exception&) {
  return false;
}

bool IsKnownWithoutPixels(const gdcm::File& file) {
  gdcm::MediaStorage kind;
  kind.SetFromFile(file);
  return !kind.IsUndefined() && !gdcm::MediaStorage::IsImage(kind);
}

// One header per image of the file that has a place, or one for the file.
std::vector<DicomHeader> MakeHeaders(DicomHeader header, const gdcm::DataSet& data) {
  const ImageTags image(data);
  if (header.frames > 1 && image.PlacedFrames() != header.frames) {
    header.lacking = fmt::format(
        "a Per-frame Functional Groups Sequence (5200,9230) that places each of their images");
    return {header};
  }
  std::vector<DicomHeader> headers;
  for (int frame = 0; frame < header.frames; ++frame) {
    DicomHeader& one = headers.emplace_back(header);
    one.frame = frame;
    SetPlace(image, one);
    SetValues(data, image, one);
  }
  return headers;
}

// ---------------------------------------------------------------------------------------------
// The pixels of a DICOM file
// ---------------------------------------------------------------------------------------------

struct DicomPixels {
  std::filesystem::path file;
  gdcm::PixelFormat format;
  std::vector<char> bytes;
  std::size_t image_bytes = 0;
};

DicomPixels ReadPixels(const DicomHeader& header) {
  const std::string where = header.file.string();
  gdcm::PixmapReader reader;
  reader.SetFileName(where.c_str());
  if (!reader.Read()) {
    throw IoError(fmt::format("{}: its pixels cannot be read; copy or export it again", where));
  }
  const gdcm::Pixmap& image = reader.GetPixmap();
  DicomPixels pixels{.file = header.file, .format = image.GetPixelFormat(), .bytes = {}};
  if (pixels.format.GetSamplesPerPixel() != 1 ||
      image.GetPhotometricInterpretation() == gdcm::PhotometricInterpretation::PALETTE_COLOR) {
    throw InputError(fmt::format("{}: its pixels are colours; grey values are needed", where));
  }
  pixels.image_bytes =
      static_cast<std::size_t>(header.rows) * header.columns * pixels.format.GetPixelSize();
  pixels.bytes.resize(image.GetBufferLength());
  if (pixels.bytes.size() != pixels.image_bytes * header.frames ||
      !image.GetBuffer(pixels.bytes.data())) {
    throw IoError(fmt::format(
        "{}: its pixels are damaged, or compressed in a way that is not read; copy or export it "
        "again, uncompressed",
        where));
  }
  return pixels;
}

void AppendImage(const DicomPixels& pixels, const DicomHeader& header, VoxelArray& array) {
  const char* const from = pixels.bytes.data() + pixels.image_bytes * header.frame;
  const std::size_t count = static_cast<std::size_t>(header.rows) * header.columns;
  const Rescale rescale{.slope = std::isnan(header.slope) ? 1 : header.slope,
                        .intercept = std::isnan(header.intercept) ? 0 : header.intercept};
  using gdcm::PixelFormat;
  switch (pixels.format.GetScalarType()) {
    case PixelFormat::UINT8:
      return AppendScaled<std::uint8_t>(from, count, rescale, array);
    case PixelFormat::INT8:
      return AppendScaled<std::int8_t>(from, count, rescale, array);
    case PixelFormat::UINT12:
    case PixelFormat::UINT16:
      return AppendScaled<std::uint16_t>(from, count, rescale, array);
    case PixelFormat::INT12:
    case PixelFormat::INT16:
      return AppendScaled<std::int16_t>(from, count, rescale, array);
    case PixelFormat::UINT32:
      return AppendScaled<std::uint32_t>(from, count, rescale, array);
    case PixelFormat::INT32:
      return AppendScaled<std::int32_t>(from, count, rescale, array);
    default:
      throw InputError(fmt::format("{}: pixels of type {} are not read", header.file.string(),
                                   pixels.format.GetScalarTypeAsString()));
  }
}

void PutTag(gdcm::DataSet& data, const gdcm::Tag& tag, const gdcm::VR& vr, std::string text) {
  if (text.size() % 2 != 0) {
    text.push_back(vr == gdcm::VR::UI ? '\0' : ' ');
  }
  gdcm::DataElement element(tag);
  element.SetVR(vr);
  element.SetByteValue(text.data(), static_cast<std::uint32_t>(text.size()));
  data.Replace(element);
}

void PutNames(const DicomSeriesNames& names, int slice, double thickness_mm, gdcm::DataSet& data) {
  using gdcm::VR;
  const auto uid = [&](int part) { return fmt::format("2.25.{}{:05}", names.number, part); };
  PutTag(data, tags::kImageType, VR::CS, "DERIVED\\SECONDARY\\AXIAL");
  PutTag(data, tags::kSopClass, VR::UI, "1.2.840.10008.5.1.4.1.1.2");  // CT image
  PutTag(data, tags::kSopInstance, VR::UI, uid(100 + slice));
  PutTag(data, tags::kStudy, VR::UI, uid(1));
  PutTag(data, tags::kSeries, VR::UI, uid(2));
  PutTag(data, tags::kFrame, VR::UI, uid(3));
  PutTag(data, tags::kStudyDate, VR::DA, "20000101");  // otherwise GDCM writes the current date
  PutTag(data, tags::kStudyTime, VR::TM, "000000");
  PutTag(data, tags::kModality, VR::CS, "CT");
  PutTag(data, tags::kDescription, VR::LO, names.description);
  PutTag(data, tags::kPatient, VR::PN, names.patient);
  PutTag(data, tags::kPatientId, VR::LO, names.patient);
  PutTag(data, tags::kPatientPosition, VR::CS, "HFS");
  PutTag(data, tags::kSeriesNumber, VR::IS, "1");
  PutTag(data, tags::kInstance, VR::IS, fmt::format("{}", slice + 1));
  PutTag(data, tags::kThickness, VR::DS, fmt::format("{:.6g}", thickness_mm));
}

void PutVoxels(const CtVolume& volume, int slice, gdcm::Image& image) {
  image.SetNumberOfDimensions(2);
  image.SetDimension(0, volume.columns);
  image.SetDimension(1, volume.rows);
  image.SetPixelFormat(gdcm::PixelFormat(gdcm::PixelFormat::INT16));
  image.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image.SetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  image.SetIntercept(0);
  image.SetSlope(1);
  const Vec3 origin = volume.World(0, 0, slice);
  for (int a = 0; a < 3; ++a) {
    image.SetOrigin(a, origin[a]);
    image.SetSpacing(a, volume.spacing_mm[a]);
    image.SetDirectionCosines(a, volume.axes(a, 0));
    image.SetDirectionCosines(3 + a, volume.axes(a, 1));
  }
  gdcm::DataElement pixels(tags::kPixels);
  const std::size_t bytes = sizeof(std::int16_t) * volume.columns * volume.rows;
  pixels.SetByteValue(reinterpret_cast<const char*>(&volume.values[volume.Index(0, 0, slice)]),
                      static_cast<std::uint32_t>(bytes));
  image.SetDataElement(pixels);
}

}  // namespace

VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat format) {
  const LibraryScope scope;
  const std::string where = file.string();
  const Reader reader = MakeReader(format);
  constexpr std::uintmax_t kMaxHeader_bytes = 1 << 20;
  const std::string head = ReadHead(file, kMaxHeader_bytes);
  const HeaderPlace place = format == VolumeFormat::kNrrd ? ParseNrrdPlace(head, where)
                                                          : ParseMetaImagePlace(head, where);
  try {
    if (!reader.io->CanReadFile(where.c_str())) {
      throw IoError(
          fmt::format("{}: it is not a {} file, or its header is damaged", where, reader.name));
    }
    reader.io->SetFileName(where);
    reader.io->ReadImageInformation();
    VoxelArray array = ReadGeometry(*reader.io, file);
    if (format == VolumeFormat::kMetaImage) {
      CheckMetaImageWhole(file, static_cast<std::uintmax_t>(reader.io->GetImageSizeInBytes()));
    }
    ApplyPlace(place, array);
    array.values.reserve(VoxelCount(array));
    AppendVoxels(*reader.io, VoxelCount(array), {place.slope, place.intercept}, array, where);
    return array;
  } catch (const itk::ExceptionObject& error) {
    throw IoError(
        fmt::format("{}: the {} file cannot be read: {}", where, reader.name, ErrorText(error)));
  }
}

std::vector<DicomHeader> ScanDicom(const std::filesystem::path& file) {
  if (!CanBeSlice(file)) {
    return {};
  }
  const LibraryScope scope;
  std::ifstream in(file, std::ios::binary);
  gdcm::Reader reader;
  const bool is_whole = ReadTags(in, reader);
  const gdcm::DataSet& data = reader.GetFile().GetDataSet();
  DicomHeader header = MakeHeader(file, data);
  in.clear();
  const std::streamoff at = in.tellg();
  std::uint32_t length = 0;
  const bool has_pixels = is_whole && IsAtPixels(in, at, length);
  if (has_pixels) {
    header.fault = FaultOfPixels(in, at, length, PixelBytes(data, header));
    return MakeHeaders(std::move(header), data);
  }
  if (is_whole && IsKnownWithoutPixels(reader.GetFile())) {
    return {};
  }
  header.fault = "it ends before its pixels";
  header.rows = header.columns = -1;
  return {header};
}

VoxelArray ReadDicomSlices(std::span<const DicomHeader> slices,
                           const std::function<void(const std::string&)>& report) {
  const LibraryScope scope;
  VoxelArray array;
  DicomPixels pixels;
  for (const DicomHeader& slice : slices) {
    if (slice.file != pixels.file) {
      report(slice.file.string());
      pixels = ReadPixels(slice);
    }
    AppendImage(pixels, slice, array);
  }
  return array;
}

std::string EncodeDicomSlice(const CtVolume& volume, int slice, const DicomSeriesNames& names) {
  const LibraryScope scope;
  gdcm::ImageWriter writer;
  PutVoxels(volume, slice, writer.GetImage());
  PutNames(names, slice, volume.spacing_mm.z(), writer.GetFile().GetDataSet());
  std::ostringstream bytes(std::ios::binary);
  writer.SetStream(bytes);
  if (!writer.Write()) {
    throw IoError(
        fmt::format("DICOM: slice {} of '{}' could not be encoded", slice + 1, names.description));
  }
  return bytes.str();
}

void WriteImageVolume(const CtVolume& volume, const std::filesystem::path& file,
                      VolumeFormat format) {
  const LibraryScope scope;
  const itk::ImageIOBase::Pointer io = MakeReader(format).io;
  const std::array<int, 3> counts = {volume.columns, volume.rows, volume.slices};
  itk::ImageIORegion region(3);
  io->SetNumberOfDimensions(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const Vec3 step = volume.axes.col(axis);
    io->SetDimensions(axis, counts[axis]);
    io->SetOrigin(axis, volume.origin[axis]);
    io->SetSpacing(axis, volume.spacing_mm[axis]);
    io->SetDirection(axis, std::vector<double>{step.x(), step.y(), step.z()});
    region.SetIndex(axis, 0);
    region.SetSize(axis, counts[axis]);
  }
  io->SetIORegion(region);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetNumberOfComponents(1);
  io->SetComponentType(itk::IOComponentEnum::SHORT);
  io->SetUseCompression(true);
  io->SetFileName(file.string());
  try {
    io->Write(volume.values.data());
  } catch (const itk::ExceptionObject& error) {
    throw IoError(fmt::format("{}: cannot be written: {}", file.string(), ErrorText(error)));
  }
}

}  // namespace semblance::problems
