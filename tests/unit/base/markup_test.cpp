#include "weldcell/base/markup.hpp"

#include <gtest/gtest.h>

namespace weldcell {
namespace {

TEST(Escaped, MakesEveryByteSafe) {
  EXPECT_EQ(escaped("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(escaped("Tr\xC3\xA4ger \xE2\x82\xAC \xF0\x9F\x94\xA5"),
            "Tr\xC3\xA4ger \xE2\x82\xAC \xF0\x9F\x94\xA5");
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(escaped("\xFF"), bad);
  EXPECT_EQ(escaped("\xC0\xAF"), bad + bad) << "long form";
  EXPECT_EQ(escaped("\xED\xA0\x80"), bad + bad + bad) << "surrogate";
  EXPECT_EQ(escaped("\xF4\x90\x80\x80"), bad + bad + bad + bad) << "beyond U+10FFFF";
  EXPECT_EQ(escaped("\xE2\x82"), bad + bad) << "cut short";
  EXPECT_EQ(escaped(std::string_view("a\0b\x01", 4)), "a" + bad + "b" + bad);
}

}  // namespace
}  // namespace weldcell
