// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/itk_files.h"

// Must come first: ITK's headers otherwise include parts of an older Eigen of their own.
#include <Eigen/Dense>

#include <fmt/format.h>
#include <gdcmImageWriter.h>
#include <gdcmScanner.h>
#include <gdcmTrace.h>
#include <itkGDCMImageIO.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>

#include "problems/io/volumes/volume_headers.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Both libraries also print their errors to the terminal.
void SilenceLibraries() {
  itk::Object::SetGlobalWarningDisplay(false);
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
}

// The last sentence of ITK's message, without the address of an object in memory.
std::string ErrorText(const itk::ExceptionObject& error) {
  std::string words = error.GetDescription();
  const std::size_t address = words.find("): ");
  words = address == words.npos ? words : words.substr(address + 3);
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

template <class Value>
void AppendRounded(const void* buffer, std::size_t count, VoxelArray& array) {
  using Limits = std::numeric_limits<std::int16_t>;
  const Value* const values = static_cast<const Value*>(buffer);
  for (std::size_t n = 0; n < count; ++n) {
    const auto value = static_cast<double>(values[n]);
    if (std::isfinite(value)) {
      const double rounded = std::round(value);
      const double inside = std::clamp<double>(rounded, Limits::min(), Limits::max());
      array.clipped += inside != rounded ? 1 : 0;
      array.values.push_back(static_cast<std::int16_t>(inside));
    } else {
      ++array.not_finite;
      array.values.push_back(Limits::min());
    }
  }
}

void AppendRounded(const itk::ImageIOBase& io, const void* buffer, std::size_t count,
                   VoxelArray& array, const std::string& where) {
  using Type = itk::IOComponentEnum;
  switch (io.GetComponentType()) {
    case Type::UCHAR:
      return AppendRounded<unsigned char>(buffer, count, array);
    case Type::CHAR:
      return AppendRounded<signed char>(buffer, count, array);
    case Type::USHORT:
      return AppendRounded<unsigned short>(buffer, count, array);
    case Type::SHORT:
      return AppendRounded<short>(buffer, count, array);
    case Type::UINT:
      return AppendRounded<unsigned int>(buffer, count, array);
    case Type::INT:
      return AppendRounded<int>(buffer, count, array);
    case Type::ULONG:
      return AppendRounded<unsigned long>(buffer, count, array);
    case Type::LONG:
      return AppendRounded<long>(buffer, count, array);
    case Type::FLOAT:
      return AppendRounded<float>(buffer, count, array);
    case Type::DOUBLE:
      return AppendRounded<double>(buffer, count, array);
    default:
      throw InputError(
          fmt::format("{}: voxels of type '{}' are not read", where,
                      itk::ImageIOBase::GetComponentTypeAsString(io.GetComponentType())));
  }
}

// Appends all voxels of the file. Throws unless their number is as expected.
void AppendVoxels(itk::ImageIOBase& io, std::size_t expected, VoxelArray& array,
                  const std::string& where) {
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
  AppendRounded(io, buffer.data(), count, array, where);
}

struct Reader {
  itk::ImageIOBase::Pointer io;
  const char* name;
};

Reader MakeReader(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::kNifti:
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

// MetaImage's library loops over as many axes as the header claims, without a limit.
void CheckMetaImageAxes(const std::filesystem::path& file) {
  const std::string head = ReadHead(file);
  const std::size_t line = head.find("NDims"), sign = head.find('=', line);
  if (line == head.npos || sign == head.npos) {
    return;  // the library reports what is missing
  }
  const int axes = std::atoi(head.substr(sign + 1, 16).c_str());
  constexpr int kMaxAxes = 10;  // the limit of the library
  if (axes < 1 || axes > kMaxAxes) {
    throw InputError(
        fmt::format("{}: NDims is not a number of axes; a volume has 3", file.string()));
  }
}

// The libraries of NIfTI and MetaImage do not report a file that ends too early; that of NRRD does.
// The size of a MetaImage shows it if the MetaImage is one file and not compressed.
void CheckMetaImageWhole(const std::filesystem::path& file, std::uintmax_t needed) {
  const std::string head = ReadHead(file);
  const std::size_t local = head.find("LOCAL");
  if (local == head.npos || head.find("CompressedData = True") != head.npos) {
    return;
  }
  if (std::filesystem::file_size(file) < needed + head.find('\n', local) + 1) {
    throw IoError(fmt::format(
        "{}: the file is cut short: {} bytes of voxels are needed; copy or export it again",
        file.string(), needed));
  }
}

// Refuses files that end the libraries or keep them busy forever. ITK's decomposition of a NIfTI
// matrix does not end if the matrix holds a huge number or one that is not finite.
void CheckForLibrary(const std::filesystem::path& file, VolumeFormat format) {
  if (format == VolumeFormat::kMetaImage) {
    CheckMetaImageAxes(file);
  } else if (format == VolumeFormat::kNifti) {
    CheckNiftiPlace(file);
  }
}

// ITK's size of a NIfTI does not serve here: ITK converts voxels with a slope to floats.
void CheckWhole(const std::filesystem::path& file, VolumeFormat format,
                const itk::ImageIOBase& io) {
  if (format == VolumeFormat::kMetaImage) {
    CheckMetaImageWhole(file, static_cast<std::uintmax_t>(io.GetImageSizeInBytes()));
  } else if (format == VolumeFormat::kNifti) {
    CheckNiftiWhole(file, static_cast<double>(io.GetImageSizeInPixels()));
  }
}

HeaderPlace ReadNiftiPlace(const std::filesystem::path& file) {
  HeaderPlace place;
  if (!NiftiHasPlace(file)) {
    place.notes.emplace_back(
        "the file does not state its orientation (its qform_code and sform_code are 0); taken as "
        "LPS");
  }
  return place;
}

HeaderPlace ReadPlace(const std::filesystem::path& file, VolumeFormat format) {
  constexpr std::uintmax_t kMaxHeader_bytes = 1 << 20;
  switch (format) {
    case VolumeFormat::kNifti:
      return ReadNiftiPlace(file);
    case VolumeFormat::kNrrd:
      return ParseNrrdPlace(ReadHead(file, kMaxHeader_bytes), file.string());
    default:
      return ParseMetaImagePlace(ReadHead(file, kMaxHeader_bytes));
  }
}

std::size_t VoxelCount(const VoxelArray& array) {
  return static_cast<std::size_t>(array.counts[0]) * array.counts[1] * array.counts[2];
}

namespace tags {
const gdcm::Tag kImageType(0x0008, 0x0008), kSopClass(0x0008, 0x0016), kSopInstance(0x0008, 0x0018);
const gdcm::Tag kStudyDate(0x0008, 0x0020), kStudyTime(0x0008, 0x0030);
const gdcm::Tag kModality(0x0008, 0x0060), kDescription(0x0008, 0x103e), kPatient(0x0010, 0x0010);
const gdcm::Tag kPatientId(0x0010, 0x0020), kThickness(0x0018, 0x0050);
const gdcm::Tag kPatientPosition(0x0018, 0x5100), kStudy(0x0020, 0x000d), kSeries(0x0020, 0x000e);
const gdcm::Tag kSeriesNumber(0x0020, 0x0011), kInstance(0x0020, 0x0013);
const gdcm::Tag kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037), kFrame(0x0020, 0x0052);
const gdcm::Tag kFrames(0x0028, 0x0008), kRows(0x0028, 0x0010), kColumns(0x0028, 0x0011);
const gdcm::Tag kSpacing(0x0028, 0x0030), kPixels(0x7fe0, 0x0010);
}  // namespace tags

std::string Text(const gdcm::Scanner& scanner, const std::string& file, const gdcm::Tag& tag) {
  const char* const value = scanner.GetValue(file.c_str(), tag);
  std::string text = value ? value : "";
  text.erase(0, std::min(text.size(), text.find_first_not_of(' ')));
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

// The numbers of a tag, separated by backslashes; empty unless their number is as expected.
std::vector<double> Numbers(const std::string& text, std::size_t expected) {
  std::vector<double> numbers;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, '\\');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(part.c_str(), &end));
    if (end == part.c_str()) {
      return {};
    }
  }
  return numbers.size() == expected ? numbers : std::vector<double>();
}

int Count(const std::string& text, int otherwise) {
  const std::vector<double> number = Numbers(text, 1);
  constexpr double kMaxCount = 1e9;  // larger numbers do not fit an int
  return number.empty() || !(std::abs(number[0]) <= kMaxCount) ? otherwise
                                                               : static_cast<int>(number[0]);
}

DicomHeader MakeHeader(const gdcm::Scanner& scanner, const std::string& file) {
  const auto text = [&](const gdcm::Tag& tag) { return Text(scanner, file, tag); };
  DicomHeader header{.file = file,
                     .series_uid = text(tags::kSeries),
                     .series_number = text(tags::kSeriesNumber),
                     .description = text(tags::kDescription),
                     .modality = text(tags::kModality),
                     .image_type = text(tags::kImageType),
                     .rows = Count(text(tags::kRows), -1),
                     .columns = Count(text(tags::kColumns), -1),
                     .frames = Count(text(tags::kFrames), 1),
                     .position = {},
                     .along_columns = {},
                     .along_rows = {},
                     .spacing_mm = {}};
  const std::vector<double> p = Numbers(text(tags::kPosition), 3);
  const std::vector<double> o = Numbers(text(tags::kOrientation), 6);
  const std::vector<double> s = Numbers(text(tags::kSpacing), 2);
  if (!p.empty()) {
    header.position = Vec3(p[0], p[1], p[2]);
  }
  if (!o.empty()) {
    header.along_columns = Vec3(o[0], o[1], o[2]).normalized();
    header.along_rows = Vec3(o[3], o[4], o[5]).normalized();
  }
  if (!s.empty()) {
    header.spacing_mm = Vec2(s[1], s[0]);  // the tag has the spacing between rows first
  }
  return header;
}

// True for a file with "DICM" after 128 bytes that is not the table of contents of a disc. GDCM
// would scan other files too, and some of them end the program.
bool CanBeSlice(const std::filesystem::path& file) {
  if (file.filename().string().starts_with("DICOMDIR")) {
    return false;
  }
  std::array<char, 132> head = {};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  return in && std::string_view(head.data() + 128, 4) == "DICM";
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
  SilenceLibraries();
  const std::string where = file.string();
  const Reader reader = MakeReader(format);
  CheckForLibrary(file, format);
  try {
    if (!reader.io->CanReadFile(where.c_str())) {
      throw IoError(
          fmt::format("{}: it is not a {} file, or its header is damaged", where, reader.name));
    }
    const HeaderPlace place = ReadPlace(file, format);
    reader.io->SetFileName(where);
    reader.io->ReadImageInformation();
    VoxelArray array = ReadGeometry(*reader.io, file);
    CheckWhole(file, format, *reader.io);
    ApplyPlace(place, array);
    array.values.reserve(VoxelCount(array));
    AppendVoxels(*reader.io, VoxelCount(array), array, where);
    return array;
  } catch (const itk::ExceptionObject& error) {
    throw IoError(
        fmt::format("{}: the {} file cannot be read: {}", where, reader.name, ErrorText(error)));
  }
}

std::vector<DicomHeader> ScanDicom(const std::vector<std::filesystem::path>& files) {
  SilenceLibraries();
  gdcm::Scanner scanner;
  for (const gdcm::Tag& tag : {tags::kImageType, tags::kModality, tags::kDescription, tags::kSeries,
                               tags::kSeriesNumber, tags::kPosition, tags::kOrientation,
                               tags::kFrames, tags::kRows, tags::kColumns, tags::kSpacing}) {
    scanner.AddTag(tag);
  }
  gdcm::Directory::FilenamesType names;
  for (const std::filesystem::path& file : files) {
    if (CanBeSlice(file)) {
      names.push_back(file.string());
    }
  }
  scanner.Scan(names);
  std::vector<DicomHeader> headers;
  for (const std::string& name : names) {
    if (scanner.IsKey(name.c_str())) {
      headers.push_back(MakeHeader(scanner, name));
    }
  }
  return headers;
}

void AppendDicomSlice(const DicomHeader& header, VoxelArray& array) {
  const std::string where = header.file.string();
  try {
    const auto io = itk::GDCMImageIO::New();
    io->SetFileName(where);
    io->ReadImageInformation();
    CheckClaim(*io, header.file);
    AppendVoxels(*io, static_cast<std::size_t>(header.columns) * header.rows, array, where);
  } catch (const itk::ExceptionObject& error) {
    throw IoError(fmt::format("{}: its pixels cannot be read: {}", where, ErrorText(error)));
  }
}

std::string EncodeDicomSlice(const CtVolume& volume, int slice, const DicomSeriesNames& names) {
  SilenceLibraries();
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
  SilenceLibraries();
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
