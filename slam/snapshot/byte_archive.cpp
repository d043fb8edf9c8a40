#include "slam/snapshot/byte_archive.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <stdexcept>

namespace sqslam {
namespace {

struct FreeContext {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

}  // namespace

std::string Deflate(std::string_view raw, int level) {
  uLongf size = compressBound(raw.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()),
                raw.size(), level) != Z_OK) {
    throw std::runtime_error("zlib cannot compress");
  }
  packed.resize(size);
  return packed;
}

std::string Inflate(std::string_view packed, std::size_t size, const std::string& what) {
  std::string raw(size, '\0');
  uLongf raw_size = raw.size();
  if (uncompress(reinterpret_cast<Bytef*>(raw.data()), &raw_size,
                 reinterpret_cast<const Bytef*>(packed.data()), packed.size()) != Z_OK ||
      raw_size != size) {
    throw InputError(what + " is broken");
  }
  return raw;
}

std::string PackPatch(std::string_view raw, std::string_view base) {
  const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
  // The window must span both for matches to reach back to the beginning of the base.
  const int window = std::clamp(static_cast<int>(std::bit_width(raw.size() + base.size())), 10, 27);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, window);
  ZSTD_CCtx_refPrefix(context.get(), base.data(), base.size());
  std::string packed(ZSTD_compressBound(raw.size()), '\0');
  const std::size_t size =
      ZSTD_compress2(context.get(), packed.data(), packed.size(), raw.data(), raw.size());
  if (ZSTD_isError(size)) {
    throw std::runtime_error(std::string("compression fails: ") + ZSTD_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}

std::string UnpackPatch(std::string_view packed, std::string_view base, std::size_t max_size,
                        const std::string& what) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size > max_size) {  // including the codes for an unknown size and for bytes that are no frame
    throw InputError(what + " is broken");
  }
  std::string raw(size, '\0');
  const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  ZSTD_DCtx_refPrefix(context.get(), base.data(), base.size());
  if (ZSTD_decompressDCtx(context.get(), raw.data(), raw.size(), packed.data(), packed.size()) != size) {
    throw InputError(what + " is broken");
  }
  return raw;
}

}  // namespace sqslam
