#pragma once
// Checksums that files need: SHA-256 (model files) and CRC-32C (TensorBoard records). Not for secrets.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace consac {

/// Lower-case hex SHA-256 of the concatenation of `pieces`. Source: FIPS 180-4.
std::string Sha256Hex(std::span<const std::span<const std::byte>> pieces);
/// CRC-32C (Castagnoli). Crc32c("123456789") is 0xE3069283.
std::uint32_t Crc32c(std::span<const std::byte> bytes);

}  // namespace consac
