#include "src/rosbag2/compression.h"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "src/recording/input_error.h"

namespace ear::rosbag2 {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 16U;

/// Makes room for the next piece behind what is there.
void grow(std::vector<std::uint8_t>& out, std::size_t used, std::size_t most) {
  if (used >= most) throw InputError("unpacks to more than " + std::to_string(most) + " bytes");
  if (out.size() - used < kPiece) out.resize(std::min(std::max(2 * out.size(), used + kPiece), most));
}

std::vector<std::uint8_t> from_zstd(Bytes bytes, std::size_t most) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  std::vector<std::uint8_t> out;
  ZSTD_inBuffer in{bytes.data, bytes.size, 0};
  std::size_t used = 0, hint = 1;
  while (in.pos < in.size || hint > 0) {
    grow(out, used, most);
    ZSTD_outBuffer piece{out.data(), out.size(), used};
    const std::size_t taken = in.pos;
    hint = ZSTD_decompressStream(stream.get(), &piece, &in);
    if (ZSTD_isError(hint) != 0) throw InputError(std::string("not zstd, or damaged: ") + ZSTD_getErrorName(hint));
    if (in.pos == taken && piece.pos == used) throw InputError("zstd: ends early");
    used = piece.pos;
  }
  out.resize(used);
  return out;
}

std::vector<std::uint8_t> from_lz4(Bytes bytes, std::size_t most) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) throw InputError("lz4: no memory");
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owned(context,
                                                                                   &LZ4F_freeDecompressionContext);
  std::vector<std::uint8_t> out;
  std::size_t taken = 0, used = 0, hint = 1;
  while (taken < bytes.size || hint > 0) {
    grow(out, used, most);
    std::size_t written = out.size() - used, read = bytes.size - taken;
    hint = LZ4F_decompress(context, out.data() + used, &written, bytes.data + taken, &read, nullptr);
    if (LZ4F_isError(hint) != 0) throw InputError(std::string("not lz4, or damaged: ") + LZ4F_getErrorName(hint));
    if (read == 0 && written == 0) throw InputError("lz4: ends early");
    taken += read;
    used += written;
  }
  out.resize(used);
  return out;
}

}  // namespace

std::vector<std::uint8_t> decompressed(Bytes bytes, const std::string& compression, std::size_t most) {
  if (compression == "zstd") return from_zstd(bytes, most);
  if (compression == "lz4") return from_lz4(bytes, most);
  if (!compression.empty() && compression != "none") {
    throw InputError("compression '" + compression + "' is not known: zstd, lz4");
  }
  if (bytes.size > most) throw InputError("more than " + std::to_string(most) + " bytes");
  return {bytes.data, bytes.data + bytes.size};
}

std::vector<std::uint8_t> compressed_zstd(Bytes bytes, int level) {
  std::vector<std::uint8_t> out(ZSTD_compressBound(bytes.size));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data, bytes.size, level);
  if (ZSTD_isError(size) != 0) throw InputError(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

void decompress_zstd_file(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in(from, std::ios::binary);
  if (!in) throw InputError(located(from, 0, "", "cannot be read"));
  std::ofstream out(to, std::ios::binary);
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  std::vector<char> packed(kPiece), plain(kPiece);
  std::size_t hint = 1;
  while (in.read(packed.data(), static_cast<std::streamsize>(packed.size())), in.gcount() > 0) {
    ZSTD_inBuffer piece{packed.data(), static_cast<std::size_t>(in.gcount()), 0};
    bool more = true;
    while (more) {
      ZSTD_outBuffer made{plain.data(), plain.size(), 0};
      hint = ZSTD_decompressStream(stream.get(), &made, &piece);
      if (ZSTD_isError(hint) != 0) {
        throw InputError(located(from, 0, "", std::string("not zstd, or damaged: ") + ZSTD_getErrorName(hint)));
      }
      out.write(plain.data(), static_cast<std::streamsize>(made.pos));
      more = piece.pos < piece.size || made.pos == made.size;
    }
  }
  if (!out.flush()) throw InputError(located(to, 0, "", "cannot be written"));
}

std::uint32_t crc32_of(Bytes bytes, std::uint32_t begin) {
  return static_cast<std::uint32_t>(::crc32_z(begin, bytes.data, bytes.size));
}

}  // namespace ear::rosbag2
