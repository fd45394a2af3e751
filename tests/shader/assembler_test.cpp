// The assembler: words against words made by hand, the dialect construct by construct, errors with their places, pairs and hazards, and text of words
// that gives the same words again.
#include "golden/shader/assembler.hpp"

#include <gtest/gtest.h>

#include <cinttypes>
#include <fstream>
#include <iterator>

#include "testbench/kit/random.hpp"

namespace retrace::shader {
namespace {

constexpr std::uint32_t kIdentity = 0xe4, kEvery = 15;

Instruction only(const std::string& text) {
  const Assembled program = assemble(text, "test");
  EXPECT_EQ(program.words.size(), 1u) << text;
  return decode(program.words.at(0));
}
std::string notes_of(const Assembled& program) {
  std::string all;
  for (const Note& note : program.notes)
    all += std::to_string(note.line) + ":" + std::to_string(note.column) + ": " + note.text + "\n";
  return all;
}
std::string read_program(const std::string& name) {
  std::ifstream file(RETRACE_SOURCE_DIR "/golden/shader/programs/" + name);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(Assembler, a_word_by_hand) {
  Instruction expected;
  expected.op = 5;        // mad
  expected.modifier = 1;  // _sat
  expected.target = 6;
  expected.mask = 0b0011;
  expected.a = {.swizzle = 0b10101010, .index = 8, .scale = 0, .negate = 0};
  expected.b = {.swizzle = 0b11100100, .index = 64 + 31, .scale = 3, .negate = 1};
  expected.c.immediate = 1;  // 0.5: 0x3f000000, its upper 19 bits
  const std::uint32_t half = 0x3f000000u >> 13;
  expected.c.swizzle = half & 0xff;
  expected.c.index = half >> 8 & 0x7f;
  expected.c.scale = half >> 15 & 3;
  expected.c.negate = half >> 17 & 1;
  expected.c.unused = half >> 18 & 1;
  expected.second = 8;  // jmp
  expected.payload = 0;
  expected.classes = 0b1001;
  expected.lanes = 0b0011;
  expected.all = 0;
  EXPECT_EQ(only("here: mad_sat R6.xy, R8.z, -0.5*C31, +0.5 + jmp here, or xy (<0 or >=1)"), expected);
  // Fields from the lowest bit up.
  const Word word = encode(expected);
  EXPECT_EQ(word[0] & 31, 5u);
  EXPECT_EQ(word[0] >> 5 & 3, 1u);
  EXPECT_EQ(word[0] >> 9 & 63, 6u);
  EXPECT_EQ(word[0] >> 15 & 15, 3u);
  EXPECT_EQ(word[0] >> 19 & 0xfffff, 0xaau | 8u << 8);
  EXPECT_EQ(word[1] >> (108 - 64), 0u);
}

TEST(Assembler, the_unit_triangle_is_13_words) {
  const std::string text = read_program("unit_triangle.asm");
  const Assembled program = assemble(text, "unit_triangle.asm");
  EXPECT_EQ(program.words.size(), 13u);
  const Instruction save = decode(program.words[11]);
  EXPECT_EQ(save.op, static_cast<std::uint32_t>(kOpMov));
  EXPECT_EQ(save.second, static_cast<std::uint32_t>(kSecondMov));
  EXPECT_EQ(decode(program.words[8]).second, static_cast<std::uint32_t>(kSecondReturn));
  EXPECT_NE(listing(program, text).find("13 words"), std::string::npos);
}

// Every construct of the published dialect; no text of its authors.
TEST(Assembler, the_dialect) {
  constexpr std::pair<const char*, std::size_t> kTexts[]{
      {"ld4x PRETRI,0", 1},
      {"ld4x PREOBJ , 4", 1},
      {"ld I3,PRETRI,3", 1},
      {"load I0, A0, 0", 1},
      {"load4x A.y,0", 1},
      {"load4x I0,A.w,+8", 1},
      {"load I1, TRIADDR, 2\nload I2, HIT_OBJ, 255", 2},
      {"ld R5.xy,A1,3", 2},
      {"load A.x,1", 1},
      {"par(dp3_rcp R7.z,I2,R3 dp3 R7.y,I1,R3\n dph3 R6.x,I0,R2)", 3},
      {"par\t(\n mov R4.xyz,R8 + mov RC5.w,I3\n mov H.w,R8.z + exit 1\n ;nothing\n )", 2},
      {"par (mov E0,R0\n mov E1,S\n mov E2,C3\n mov R4,C.xxww + trace push 0 rty 0)", 4},
      {"mov E2.w,I3 + trace push 15 rty 3", 1},
      {"mov E0,H + call push 3 rty 1", 1},
      {"trace C0, R0, C4", 1},
      {"call HIT.w push 2", 1},
      {"f: call f push 4\n call f", 2},
      {"nohit: exit 0", 1},
      {"exit", 1},
      {"exit 1, w <0", 1},
      {"a: jmp a", 1},
      {"2: jmp 2, z >=0", 1},
      {"a:mul R8.z,-R6,S+jmp a,z <0", 1},
      {"a:\n b: c: mov R0,R1\n+ jmp a,and w (>=0 or <1)\njmp c, or xyzw (>=0 or <1)", 2},
      {"return\nreturn w >=1\nreturn or xy (<0 or >=1)\nreturn or xyzw (>=0 and <1)", 4},
      {"mov R0,R1 + if and xyz (!=0) return\nif w >0 exit 3\n add R0,R1,R2 + if x <=0 call HIT.w push 1", 3},
      {"mov R0, R4.xyx + return or xyzw (>=0 or <1)", 1},
      {"add R2.zw,C.y,-R3.xyxy", 1},
      {"mul R2,R2.zxzx,R2.wwyy", 1},
      {"mov R3.w,-0.063", 1},
      {"mul_sat O,R2.xy,+0.00390625", 1},
      {"mad R6,+0.01,R3,R0\nmad_sat R15.w, 0.6, R15.w, 0.4\nadd R0,R2.xy,-64.0", 3},
      {"dp4_rcp R6.x,R8,C3.xyyy\ndp4_rsq R6.y,R8,C3.yyyx\nadd_rcp R1.w,R1.w,C.y\nmov_rcpx R0,R1\nfrac_rsq.y R0,R1", 5},
      {"dp2h R0.x,R1,P\ndph2 R0.x,R1,P\ndp3h R0.x,R1,P\ndph3_sat R0.x,R1,P\ndph2_rcpw R0,R1,R2", 5},
      {"texld I0,R2,R1\ntexld4x R3,R2\ntexld_word_fp I1,C2.xy,R2.xy\ntexld4x_word_fp C2.zw,R1\ntexload I3,R0,R1", 5},
      {"texload4x I0,R2,R1\ntexload4x R2,R1\ntexstore C0,R1,R2\nstore A2,5,R0.xxyy", 4},
      {"mov RC4, C0 + exit 0\nmov SID,I3.x + mov MAX,R8.z", 2},
      {"mov A.zw,I3\nmov A,I0\nmov A0,R0.w\nmov R0.x,TRI\nmov R1,-OBJ", 5},
      {"mov_sat R0.x,R1.yx + add R0.zw,R1.wwww,R2.wwwz", 1},
      {"mad R6.xyz,R7.z,R3,R2\n+ mov RC5.w,I3", 2},
      {"mov R6.w,I3.x + ld4x PRETRI,4", 1},
      {"mov R0,2*R1 + mov R1,-4*R2.x\nadd R0,0.5*C1,-1*I0", 2},
      {"mov R0,ONE\nmov R1,1e-3\nmov R2,.5\nmov R3,-3.402823466e+38", 4},
      {"mov R0,C0;remark\r\n\tmov R1,C1 // another\r\n", 2},
      {"nop", 1},
      {"nop + load I0,A.x,0", 1},
      {".word 0x7f8000600000000000047238801", 1},
      {"; nothing\n", 0},
      {"", 0}};
  for (const auto& [text, words] : kTexts) {
    try {
      const Assembled program = assemble(text, "test");
      EXPECT_EQ(program.words.size(), words) << text << "\n" << notes_of(program);
      for (const Word& word : program.words) EXPECT_TRUE(is_valid(decode(word))) << text << ": " << disassemble(word);
      EXPECT_EQ(assemble(disassemble(program.words), "again").words, program.words) << text << "\n"
                                                                                    << disassemble(program.words);
    } catch (const AssemblyError& error) {
      ADD_FAILURE() << text << "\n" << error.what();
    }
  }
}

TEST(Assembler, what_spellings_mean) {
  EXPECT_EQ(only("dph3 R6.x,I0,R2"), only("dp3h R6.x,I0,R2"));
  EXPECT_EQ(only("ld4x A1,0"), only("load4x A.y,0"));
  EXPECT_EQ(only("mov R0,R1.xy"), only("mov R0,R1.xyyy"));
  EXPECT_EQ(only("mov R0,R1.z"), only("mov R0,R1.zzzz"));
  EXPECT_EQ(only("mov R0.wx,R1"), only("mov R0.xw,R1"));
  EXPECT_EQ(only("mov R0,TRI"), only("mov R0,ADDR.x"));
  EXPECT_EQ(only("return or xyzw (>=0 or <1)"), only("return"));
  EXPECT_EQ(only("mov R0,R1 + if z <0 return"), only("mov R0,R1\n+ return z <0"));
  EXPECT_EQ(only("call push 2 rty 1").second, static_cast<std::uint32_t>(kSecondMaterial));
  EXPECT_EQ(only("dp3_rcp R7.z,I2,R3").component, 2u);
  EXPECT_EQ(only("mov_rcp R7,I2").component, 3u);
  EXPECT_EQ(only("mov_rcpy R7,I2").component, 1u);
  EXPECT_EQ(only("return w =0").classes, 2u);
  EXPECT_EQ(only("return w <=0").classes, 3u);
  EXPECT_EQ(only("return w >0").classes, 12u);
  EXPECT_EQ(only("return w (>=0 and <1)").classes, 6u);
  EXPECT_EQ(only("mov R0,-0.5").a, only("mov R0, - 0.5").a);
}

TEST(Assembler, errors_say_where_and_what_was_expected) {
  struct Case {
    const char* text;
    int line, column;
    const char* expected;
  };
  constexpr Case kCases[]{
      {"mov R0", 1, 7, "expected ',' before source 1 of 1 of mov, found the end of the program"},
      {"mov R0,R1\nadd R1,R2\nmul R0,R1,R2", 3, 1, "expected ',' before source 2 of 2 of add, found 'mul'"},
      {"mov R0,R1,R2", 1, 10, "expected the end of mov"},
      {"mov R16,R1", 1, 5, "expected a register that can be written, found 'R16'"},
      {"mov C0,R1", 1, 5, "expected a register that can be written, found 'C0'"},
      {"mov P,R1", 1, 5, "expected a register that can be written, found 'P'"},
      {"mov R0,C32", 1, 8, "expected a register or a number, found 'C32'"},
      {"mov R0.xq,R1", 1, 8, "expected components of x, y, z, w, found 'xq'"},
      {"mov R0,R1.xyzwx", 1, 11, "expected up to four components"},
      {"mov R0,3*R1", 1, 8, "expected a factor of 0.5, 1, 2 or 4, found '3'"},
      {"foo R0,R1", 1, 1, "expected an instruction, found 'foo'"},
      {"\n\n  mov_foo R0,R1", 3, 3, "expected one of the suffixes _sat, _rcp, _rsq, found 'mov_foo'"},
      {"mov_rcpq R0,R1", 1, 1, "expected a component x, y, z or w after the suffix"},
      {"mov_sat.x R0,R1", 1, 9, "expected a component x, y, z or w of _rcp or _rsq"},
      {"texld_sat I0,R1,R2", 1, 1, "expected an instruction without a suffix"},
      {"jmp nowhere", 1, 5, "expected a label of the program, found 'nowhere'"},
      {"a: mov R0,R1\na: mov R0,R1", 2, 1, "expected a label that the program does not have yet, found 'a'"},
      {"jmp", 1, 4, "expected a label, found the end of the program"},
      {"a: jmp a, xy <0", 1, 11, "expected 'and' or 'or' before several components, found 'xy'"},
      {"return w >1", 1, 10, "expected < or >= before 1, found '>'"},
      {"return w <2", 1, 11, "expected 0 or 1"},
      {"return w (<0", 1, 13, "expected ')' after the condition"},
      {"return or (<0)", 1, 11, "expected components of x, y, z, w"},
      {"load I4,A0,0", 1, 6, "expected a register that can be written, found 'I4'"},
      {"load I0,R0,0", 1, 9, "expected an address A0 to A3, A.x to A.w, TRI, OBJ, PRETRI or PREOBJ, found 'R0'"},
      {"load I0,A,0", 1, 9, "expected an address"},
      {"load I0,A0,256", 1, 12, "expected an offset from 0 to 255, found '256'"},
      {"load I0,A0,1.5", 1, 12, "expected an offset from 0 to 255, found '1.5'"},
      {"load I0,A0,-1", 1, 12, "expected an offset from 0 to 255, found '-'"},
      {"call f push 16\nf: return", 1, 13, "expected a number of registers from 0 to 15"},
      {"trace push 1 rty 4", 1, 18, "expected a kind of ray from 0 to 3"},
      {"exit 256", 1, 6, "expected a code from 0 to 255"},
      {"par mov R0,R1", 1, 5, "expected '(' after 'par', found 'mov'"},
      {"par (mov R0,R1", 1, 15, "expected ')' of the par in line 1, found the end of the program"},
      {"par (par (mov R0,R1))", 1, 6, "expected an instruction: a par holds no other"},
      {"mov R0,R1 +", 1, 12, "expected an instruction, found the end of the program"},
      {"return + mov R0,R1", 1, 10, "expected nothing after 'return', which ends an instruction, found 'mov'"},
      {"mov R0.xy,R1 + mov R0.yz,R2", 1, 16, "both write R0.y"},
      {"mov_rcp R0,R1 + mov S.w,R2", 1, 17, "both write S.w"},
      {"mad R0,R1,R2,R3 + mad R1,R0,R2,R3", 1, 19, "each reads what the other writes"},
      {"ld R5,A0,0 + mov R0,R1", 1, 12, "expected the end of an instruction that takes two words"},
      {"mov R0,$1", 1, 8, "expected an instruction, found '$'"},
      {"mov R0,\x01", 1, 8, "found byte 0x01"},
      {"mov R0,1e999", 1, 8, "expected a number, found '1e999'"},
      {".word 12", 1, 7, "expected 0x and up to 27 hexadecimal digits"},
      {".word 0x1234567812345678123456781234", 1, 7, "expected 0x and up to 27 hexadecimal digits"},
      {".word 0xG", 1, 7, "expected 0x and up to 27 hexadecimal digits"},
      {"if w <0 mov R0,R1", 1, 9, "expected jmp, call, trace, return or exit after the condition"},
      {"if w <0 return x <0", 1, 1, "expected one condition for the instruction"}};
  for (const Case& each : kCases) {
    try {
      assemble(each.text, "file.asm");
      ADD_FAILURE() << "no error: " << each.text;
    } catch (const AssemblyError& error) {
      EXPECT_EQ(error.line, each.line) << each.text << "\n" << error.what();
      EXPECT_EQ(error.column, each.column) << each.text << "\n" << error.what();
      EXPECT_NE(std::string(error.what()).find(each.expected), std::string::npos) << each.text << "\n" << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  std::string long_program;
  for (int i = 0; i < kProgramWords; ++i) long_program += "nop\n";
  EXPECT_EQ(assemble(long_program, "long").words.size(), static_cast<std::size_t>(kProgramWords));
  EXPECT_THROW(assemble(long_program + "nop", "long"), AssemblyError);
}

TEST(Assembler, pairs_and_hazards) {
  const auto notes = [](const char* text) { return notes_of(assemble(text, "test")); };
  EXPECT_EQ(notes("mov R0,R1 + mov R2,R3"), "");
  EXPECT_EQ(notes("mov R0,R1 + mov R2,R0"),
            "1:13: hazard in a pair: R0.xyzw is read as it was before the first operation\n");
  EXPECT_EQ(notes("mov_rcp R0.w,R1 + mov R2,S.w"),
            "1:19: hazard in a pair: S.w is read as it was before the first operation\n");
  EXPECT_EQ(notes("par (mov R0,R1\nmov R2,R0.y)"),
            "2:1: hazard in a par: R0.y is written in line 1; instructions are executed in order, so the new value is "
            "read\n");
  EXPECT_EQ(notes("par (mov R0.xy,R1\nmov R0.y,R2)"),
            "2:1: hazard in a par: R0.y is written in line 1 too; this line is the later one\n");
  EXPECT_EQ(notes("par (mov R2,R1\nmov R1,R0)"), "");
  EXPECT_EQ(notes("mov R0.x,0.6"), "1:10: 0.6 becomes 0.600097656: an immediate has 10 bits of fraction\n");
  EXPECT_EQ(notes("mov R0.x,-0.375"), "");
  // More sources than a word has: two words, in the order that keeps what is read.
  const Assembled split = assemble("mad R6,R7,R3,R2 + mov R5,R6", "test");
  ASSERT_EQ(split.words.size(), 2u);
  EXPECT_EQ(split.words[0], assemble("mov R5,R6", "test").words[0]);
  const Assembled other = assemble("mad R6,R7,R3,R2 + mov R7,R1 ", "test");
  EXPECT_EQ(other.words[0], assemble("mad R6,R7,R3,R2", "test").words[0]);
  // The condition of a pair that takes two words looks at the same result.
  const Assembled jump = assemble("a: texld I0,R0,R1 + jmp a, w <0", "test");
  ASSERT_EQ(jump.words.size(), 2u);
  EXPECT_EQ(decode(jump.words[1]).op, static_cast<std::uint32_t>(kOpNop));
  // A dot product is first, whatever is written first.
  EXPECT_EQ(decode(assemble("mov R1,R2 + dp3 R0,R3,R4", "test").words[0]).op, static_cast<std::uint32_t>(kOpDp3));
}

TEST(Assembler, any_word_has_text_that_gives_it_again) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  int texts = 0;
  constexpr int kWords = 6'000;
  std::vector<Word> program;
  for (int i = 0; i < kWords; ++i) {
    Word word{random.bits(), random.bits() >> (128 - kWordBits)};
    if (i % 4 != 0) {  // one that means something
      Instruction in = decode(word);
      in.op = static_cast<std::uint32_t>(random.below(10));
      in.second %= 14;
      if (in.op == 0) in.target = in.mask = in.component = 0;
      if (in.modifier == kModifierSat || in.modifier == kModifierNone || in.op == 0) in.component = 0;
      if (in.op == 0) in.modifier = 0;
      if (in.second <= 5) in.classes = in.lanes = kEvery, in.all = 0;
      in.target &= 31;
      for (Source* source : {&in.a, &in.b, &in.c}) {
        source->immediate = random.chance(4);
        if (!source->immediate) source->unused = 0, source->index &= 15;
      }
      const std::array<std::uint32_t, 14> kBits{0, 11, 11, 11, 11, 11, 13, 13, 10, 14, 6, 6, 0, 8};
      in.payload &= (1u << kBits[in.second]) - 1;
      // What is not used is 0 in the assembler's words.
      std::uint32_t used = kOpTable[in.op].sources;
      if (in.second >= 1 && in.second <= 5) used += kOpTable[kSecondTable[in.second].op].sources;
      if (used < 1) in.a = {};
      if (used < 2) in.b = {};
      if (used < 3) in.c = {};
      word = encode(in);
    }
    const std::string text = disassemble(word);
    if (text[0] != '.') ++texts;
    if (program.size() < kProgramWords) program.push_back(word);
    if (text.find(" L") != std::string::npos) continue;  // in a program, below
    const Assembled again = assemble(text, "again");
    ASSERT_EQ(again.words.size(), 1u) << text << ", seed " << seed;
    ASSERT_EQ(again.words[0], word) << text << ", seed " << seed;
  }
  EXPECT_GT(texts, kWords / 4);
  EXPECT_EQ(assemble(disassemble(program), "again").words, program) << "seed " << seed;
  EXPECT_EQ(from_bytes(to_bytes(program), "bytes"), program);
}

TEST(Assembler, bytes_that_are_no_program) {
  EXPECT_THROW(from_bytes("123", "f"), Error);
  EXPECT_THROW(from_bytes(std::string(16, '\xff'), "f"), Error);
  EXPECT_THROW(from_bytes(std::string(16 * (kProgramWords + 1), '\0'), "f"), Error);
  EXPECT_TRUE(from_bytes("", "f").empty());
}

}  // namespace
}  // namespace retrace::shader
