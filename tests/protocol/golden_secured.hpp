// tests/protocol/golden_secured.hpp
#pragma once

#include <cstdint>

namespace ellicast::tests {

/// The golden datagram (golden_datagram.hpp) sealed, signed, and both. Worked out apart from the
/// codec and from libsodium; WIRE_FORMAT.md section 13.
inline constexpr const char* kGoldenSharedKeyHex =
    "40 41 42 43 44 45 46 47 48 49 4a 4b 4c 4d 4e 4f 50 51 52 53 54 55 56 57 "
    "58 59 5a 5b 5c 5d 5e 5f";
inline constexpr const char* kGoldenSeedHex =  // of the private key; RFC 8032, test 1
    "9d 61 b1 9d ef fd 5a 60 ba 84 4a f4 92 ec 2c c4 44 49 c5 69 7b 32 69 19 "
    "70 3b ac 03 1c ae 7f 60";
inline constexpr const char* kGoldenPublicKeyHex =
    "d7 5a 98 01 82 b1 0a b7 d5 4b fe d3 c9 64 07 3a 0e e1 72 f3 da a6 23 25 "
    "af 02 1a 68 f7 07 51 1a";
inline constexpr const char* kGoldenKeyIdHex = "78 49 ac 30 49 68 0b e1";
inline constexpr std::uint64_t kGoldenStartUs = 1700000000000000;
inline constexpr std::uint64_t kGoldenSentUs = 1700000001500000;
inline constexpr std::uint64_t kGoldenCounter = 0x0102030405060708;
/// Key of the session: BLAKE2b of 10 11 12 13 14 15 16 17 under the shared key.
inline constexpr const char* kGoldenSessionKeyHex =
    "29 d5 25 12 84 e0 6f ef 5e 68 51 06 2b 64 81 22 72 05 9b d2 09 41 25 e4 "
    "28 4a 14 a1 38 51 70 09";

// clang-format off
/// Header with flags 03, start, sending time, counter, ciphertext, tag.
inline constexpr const char* kGoldenSealedHex =
    "80 e0 ff fe 01 02 03 04 de ad be ef 01 03 10 11 12 13 14 15 16 17 a0 a1 "
    "a2 a3 a4 a5 a6 a7 bf 80 00 00 c0 00 00 00 bf 00 00 00 3f 80 00 00 40 00 "
    "00 00 40 80 00 00 00 00 00 02 ff ff ff fc ff ff ff fa 01 90 00 00 bd 65 "
    "00 00 00 00 03 00 00 00 05 00 00 02 7f 00 00 02 80 00 06 0a 24 18 1e 40 "
    "00 00 06 0a 24 18 35 23 60 01 02 03 04 05 06 07 08 5b bb f9 7d c3 28 f4 "
    "15 74 81 72 02 f2 4c 95 78 99 33 bd 41 bc fe f2 33 84 58 79 e1 bf cd 64 "
    "be 20 cc 36 99 ab 1b bf c6 09 f9 5b 4f fb fc ba 8a 6d 49 5d e4 66 93 d9 "
    "48 d1 4a e0 0e 4a 05 29 78 5d 77 71 cd b0 fe da db 87 5b 3e 07 92 3d 23 "
    "aa 07 1e d9 b8 5c 5e 4e cd f0 fc 3d 68 e7 54 94 e9 c4 0a 79 2e 0e 82 41 "
    "35 2b 8a d1 f9 d0 0e 59 b7 ce 62 70 20 7a 44 7e 27 02 9f 4e 7b 7b 9f 0a "
    "8e 6b d7 e2 98 e5 ec bc 81 74 e6 a4 2f f2 4f 1e 73 62";
/// Header with flags 05, start, sending time, key id, sections, signature.
inline constexpr const char* kGoldenSignedHex =
    "80 e0 ff fe 01 02 03 04 de ad be ef 01 05 10 11 12 13 14 15 16 17 a0 a1 "
    "a2 a3 a4 a5 a6 a7 bf 80 00 00 c0 00 00 00 bf 00 00 00 3f 80 00 00 40 00 "
    "00 00 40 80 00 00 00 00 00 02 ff ff ff fc ff ff ff fa 01 90 00 00 bd 65 "
    "00 00 00 00 03 00 00 00 05 00 00 02 7f 00 00 02 80 00 06 0a 24 18 1e 40 "
    "00 00 06 0a 24 18 35 23 60 78 49 ac 30 49 68 0b e1 03 00 28 3f e0 00 00 "
    "00 00 00 00 c0 90 00 00 00 00 00 00 40 08 00 00 00 00 00 00 05 68 6f 72 "
    "73 65 02 6d 6d 00 05 30 2e 31 2e 30 01 00 2e 00 01 00 00 01 8f 00 00 00 "
    "01 3e 80 00 00 bf c0 00 00 40 00 00 00 3f 00 00 00 3e 00 00 00 3f 40 00 "
    "00 be 80 00 00 00 00 00 00 3f 80 00 00 02 00 22 00 02 00 00 00 07 00 00 "
    "03 fd 3f 80 00 00 c0 00 00 00 40 80 00 00 bf 80 00 00 3d cc cc cd 40 50 "
    "00 00 68 53 67 5b d2 f6 96 2a b3 b9 de 3e 7a bb 08 c7 40 d9 df 05 db 00 "
    "33 84 8c 88 26 c1 c0 27 b7 01 97 0f cc 24 b6 b5 37 d8 8f b5 36 cd 21 d4 "
    "85 53 da 09 ac e4 cd 78 69 d6 a5 e9 87 73 05 81 a8 0b";
/// Header with flags 07, start, sending time, counter, key id, ciphertext, tag, signature.
inline constexpr const char* kGoldenSealedSignedHex =
    "80 e0 ff fe 01 02 03 04 de ad be ef 01 07 10 11 12 13 14 15 16 17 a0 a1 "
    "a2 a3 a4 a5 a6 a7 bf 80 00 00 c0 00 00 00 bf 00 00 00 3f 80 00 00 40 00 "
    "00 00 40 80 00 00 00 00 00 02 ff ff ff fc ff ff ff fa 01 90 00 00 bd 65 "
    "00 00 00 00 03 00 00 00 05 00 00 02 7f 00 00 02 80 00 06 0a 24 18 1e 40 "
    "00 00 06 0a 24 18 35 23 60 01 02 03 04 05 06 07 08 78 49 ac 30 49 68 0b "
    "e1 5b bb f9 7d c3 28 f4 15 74 81 72 02 f2 4c 95 78 99 33 bd 41 bc fe f2 "
    "33 84 58 79 e1 bf cd 64 be 20 cc 36 99 ab 1b bf c6 09 f9 5b 4f fb fc ba "
    "8a 6d 49 5d e4 66 93 d9 48 d1 4a e0 0e 4a 05 29 78 5d 77 71 cd b0 fe da "
    "db 87 5b 3e 07 92 3d 23 aa 07 1e d9 b8 5c 5e 4e cd f0 fc 3d 68 e7 54 94 "
    "e9 c4 0a 79 2e 0e 82 41 35 2b 8a d1 f9 d0 0e 59 b7 ce 62 70 20 7a 44 7e "
    "27 02 9f 4e 7b 7b 9f 0a 8e 6b 9a c2 ca 56 b0 d1 e0 c2 ad 9a f5 e6 af bb "
    "32 72 e7 d6 01 1e 42 9d 87 ad 6d 93 ff e6 cb 3b 60 24 d2 1a 9f 43 cf 5b "
    "45 91 29 92 49 88 c3 63 9a 3a c2 5c 91 71 ed 61 cb 22 76 85 8f 6a ef b2 "
    "f9 26 a5 43 63 01 ce 4d 23 e5 20 4d 34 f4 e2 a8 9f 0d";
// clang-format on

}  // namespace ellicast::tests
