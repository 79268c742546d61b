// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/encoding.h"

#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::surfaces {
namespace {

TEST(Base64, Rfc4648Examples) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(Base64, AnyBytesComeBack) {
  Random random(1);
  for (int size = 0; size < 50; ++size) {
    std::string bytes;
    for (int k = 0; k < size; ++k) {
      bytes += static_cast<char>(random.Uniform(0, 256));
    }
    EXPECT_EQ(FromBase64(Base64(bytes)), bytes);
  }
}

TEST(Base64, OtherTextIsRefused) {
  EXPECT_THROW(FromBase64("Zg="), InputError);
  EXPECT_THROW(FromBase64("Z g="), InputError);
  EXPECT_THROW(FromBase64("===="), InputError);
  EXPECT_THROW(FromBase64("Zm9v\xff\xff\xff\xff"), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
