// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/implicit_cache.h"

#include <cstring>
#include <type_traits>

#include "problems/pipeline/stage_key.h"
#include "surfaces/base/encoding.h"

namespace semblance {
namespace {

template <class T>
requires std::is_trivially_copyable_v<T>
void Append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void Append(std::string& bytes, std::span<const double> values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

void Append(std::string& bytes, const TriMesh& mesh) {
  Append(bytes, mesh.points.size());
  Append(bytes, mesh.triangles.size());
  for (const Vec3& point : mesh.points) {
    Append(bytes, std::span<const double>(point.data(), 3));
  }
  for (const Triangle& triangle : mesh.triangles) {
    Append(bytes, triangle);
  }
}

// Takes values off the front; once they run out, nothing it gives counts.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  requires std::is_trivially_copyable_v<T>
  void Take(T& value) { Take(&value, sizeof(T)); }
  void Take(TriMesh& mesh) {
    mesh.points.resize(TakeCount(3 * sizeof(double)));
    mesh.triangles.resize(TakeCount(sizeof(Triangle)));
    for (Vec3& point : mesh.points) {
      Take(point.data(), 3 * sizeof(double));
    }
    for (Triangle& triangle : mesh.triangles) {
      Take(triangle);
    }
  }
  void Take(std::string& text) {
    text.resize(TakeCount(1));
    Take(text.data(), text.size());
  }
  // A count of things of this many bytes each; 0 if there cannot be so many.
  std::size_t TakeCount(std::size_t bytes_each) {
    std::size_t count = 0;
    Take(count);
    whole_ &= count <= rest_.size() / bytes_each;
    return whole_ ? count : 0;
  }
  bool WholeAndEmpty() const { return whole_ && rest_.empty(); }

 private:
  void Take(void* to, std::size_t size) {
    whole_ &= size <= rest_.size();
    if (whole_ && size > 0) {
      std::memcpy(to, rest_.data(), size);
      rest_.remove_prefix(size);
    }
  }

  std::string_view rest_;
  bool whole_ = true;
};

// Another build may compute other bits: what it made is not taken.
const std::string& ProgramHash() {
  static const std::string hash = Sha256OfFile("/proc/self/exe");
  return hash;
}

std::string KeyOf(const TriMesh& shell, std::span<const double> depth_mm,
                  const ImplicitFaceOptions& options) {
  std::string made_from = StageKey("implicit face", options) + ProgramHash();
  Append(made_from, shell);
  Append(made_from, depth_mm);
  return Sha256OfText(made_from);
}

}  // namespace

std::string ToBytes(const ImplicitFace& face) {
  std::string bytes;
  Append(bytes, face.dense);
  Append(bytes, face.mesh);
  Append(bytes, face.cell_mm);
  Append(bytes, face.emitters);
  Append(bytes, face.emitters_per_square_depth);
  Append(bytes, face.dropped_components);
  Append(bytes, face.counts);
  Append(bytes, face.decimation);
  Append(bytes, face.notes.size());
  for (const std::string& note : face.notes) {
    Append(bytes, note.size());
    bytes += note;
  }
  return bytes;
}

std::optional<ImplicitFace> ImplicitFaceFrom(std::string_view bytes) {
  Reader reader(bytes);
  ImplicitFace face;
  reader.Take(face.dense);
  reader.Take(face.mesh);
  reader.Take(face.cell_mm);
  reader.Take(face.emitters);
  reader.Take(face.emitters_per_square_depth);
  reader.Take(face.dropped_components);
  reader.Take(face.counts);
  reader.Take(face.decimation);
  face.notes.resize(reader.TakeCount(sizeof(std::size_t)));
  for (std::string& note : face.notes) {
    reader.Take(note);
  }
  return reader.WholeAndEmpty() ? std::optional(std::move(face)) : std::nullopt;
}

ImplicitFace CachedImplicitFace(const TriMesh& shell, std::span<const double> depth_mm,
                                const ImplicitFaceOptions& options, const DiskCache* cache,
                                const RunContext& context) {
  if (!cache) {
    return BuildImplicitFace(shell, depth_mm, options, context);
  }
  const std::string key = KeyOf(shell, depth_mm, options);
  if (const std::optional<std::string> bytes = cache->Get(key)) {
    if (std::optional<ImplicitFace> face = ImplicitFaceFrom(*bytes)) {
      return std::move(*face);
    }
  }
  ImplicitFace face = BuildImplicitFace(shell, depth_mm, options, context);
  cache->Put(key, ToBytes(face));
  return face;
}

}  // namespace semblance
