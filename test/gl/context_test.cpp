#include "bodyschema/gl/context.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <thread>

#include "bodyschema/gl/functions.hpp"
#include "bodyschema/gl/program.hpp"

namespace bodyschema::gl {
namespace {

/// Each way to OpenGL that this machine offers. What the packages of scripts/setup bring must work,
/// so "auto" is never skipped.
class Platform : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::string_view(GetParam()) == "auto") {
      context_ = Context::create("auto");
      return;
    }
    try {
      context_ = Context::create(GetParam());
    } catch (const ContextError& error) {
      GTEST_SKIP() << "this machine does not offer " << GetParam() << ": " << error.what();
    }
  }
  std::unique_ptr<Context> context_;
};

// Clears a small framebuffer to a colour and reads it back.
void draw_something(Context& context) {
  const Context::Current current(context);
  ASSERT_TRUE(current.ok());
  const Functions& gl = context.functions();
  GLuint texture = 0, framebuffer = 0;
  gl.GenTextures(1, &texture);
  gl.BindTexture(GL_TEXTURE_2D, texture);
  gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, 4, 4);
  gl.GenFramebuffers(1, &framebuffer);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
  ASSERT_EQ(gl.CheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
  gl.ClearColor(1.0f, 0.0f, 1.0f, 0.0f);
  gl.Clear(GL_COLOR_BUFFER_BIT);
  unsigned char pixel[4] = {9, 9, 9, 9};
  gl.ReadPixels(2, 2, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel);
  EXPECT_THAT(pixel, testing::ElementsAre(255, 0, 255, 0));
  gl.DeleteFramebuffers(1, &framebuffer);
  gl.DeleteTextures(1, &texture);
  EXPECT_EQ(gl.GetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_P(Platform, Draws) {
  EXPECT_THAT(context_->description(), testing::HasSubstr("OpenGL 4."));
  RecordProperty("context", context_->description());
  draw_something(*context_);
  // Another thread may use it next, and another context beside it.
  const auto second = Context::create(GetParam());
  std::thread([&] { draw_something(*context_); }).join();
  draw_something(*second);
  draw_something(*context_);
}

TEST_P(Platform, SoftwareIsRecognised) {
  const bool llvmpipe = context_->renderer().find("llvmpipe") != std::string::npos;
  if (llvmpipe) {
    EXPECT_TRUE(context_->is_software());
  }
  if (std::string_view(GetParam()) == "osmesa") {
    EXPECT_TRUE(context_->is_software());
  }
}

TEST_P(Platform, ShaderErrorNamesTheProgram) {
  const Context::Current current(*context_);
  try {
    const Program program(context_->functions(), "wrong",
                          {{GL_COMPUTE_SHADER, "#version 430\nvoid main() { nonsense }\n"}});
    FAIL();
  } catch (const ContextError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("wrong"));
  }
}

INSTANTIATE_TEST_SUITE_P(Gl, Platform, testing::Values("auto", "egl_device", "egl_surfaceless", "osmesa"),
                         [](const auto& p) { return std::string(p.param); });

TEST(Context, UnknownPlatformIsNamed) {
  try {
    Context::create("glx");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("glx"));
  }
  EXPECT_THROW(Context::create(""), std::invalid_argument);
}

// A machine without any OpenGL: libglvnd finds no vendor, and there is no OSMesa.
void fail_without_gl(const char* platform) {
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/vendor.json", 1);
  setenv("BODYSCHEMA_OSMESA", "/nowhere/libOSMesa.so", 1);
  try {
    Context::create(platform);
  } catch (const ContextError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::_Exit(3);
  }
  std::_Exit(0);
}

TEST(ContextDeathTest, NoOpenGlAtAllSaysWhatWasTried) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(fail_without_gl("auto"), testing::ExitedWithCode(3),
              "no headless OpenGL.*EGL device.*EGL surfaceless.*EGL default display.*OSMesa.*nowhere");
  EXPECT_EXIT(fail_without_gl("osmesa"), testing::ExitedWithCode(3), "OSMesa: cannot load /nowhere");
  EXPECT_EXIT(fail_without_gl("egl_device"), testing::ExitedWithCode(3), "EGL device");
}

}  // namespace
}  // namespace bodyschema::gl
