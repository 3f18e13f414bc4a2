#include "bodyschema/gl/program.hpp"

#include <utility>
#include <vector>

#include "bodyschema/gl/context.hpp"

namespace bodyschema::gl {
namespace {

GLuint compile(const Functions& gl, std::string_view name, const Program::Stage& stage) {
  const GLuint shader = gl.CreateShader(stage.type);
  const GLchar* text = stage.source.data();
  const auto length = static_cast<GLint>(stage.source.size());
  gl.ShaderSource(shader, 1, &text, &length);
  gl.CompileShader(shader);
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  std::string log(4096, '\0');
  GLsizei written = 0;
  gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &written, log.data());
  log.resize(static_cast<std::size_t>(written));
  gl.DeleteShader(shader);
  throw ContextError("shader '" + std::string(name) + "' does not compile: " + log);
}

}  // namespace

Program::Program(const Functions& gl, std::string_view name, std::initializer_list<Stage> stages)
    : gl_(&gl), id_(gl.CreateProgram()) {
  std::vector<GLuint> shaders;
  try {
    for (const auto& stage : stages) {
      shaders.push_back(compile(gl, name, stage));
      gl.AttachShader(id_, shaders.back());
    }
    gl.LinkProgram(id_);
    GLint ok = GL_FALSE;
    gl.GetProgramiv(id_, GL_LINK_STATUS, &ok);
    if (ok != GL_TRUE) {
      std::string log(4096, '\0');
      GLsizei written = 0;
      gl.GetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), &written, log.data());
      log.resize(static_cast<std::size_t>(written));
      throw ContextError("shader program '" + std::string(name) + "' does not link: " + log);
    }
  } catch (...) {
    for (const GLuint shader : shaders) gl.DeleteShader(shader);
    gl.DeleteProgram(id_);
    throw;
  }
  for (const GLuint shader : shaders) gl.DeleteShader(shader);
}

Program::~Program() {
  if (id_ != 0) gl_->DeleteProgram(id_);
}

Program::Program(Program&& other) noexcept : gl_(other.gl_), id_(std::exchange(other.id_, 0)) {}

void Program::use() const {
  gl_->UseProgram(id_);
}

GLint Program::uniform(const char* name) const {
  return gl_->GetUniformLocation(id_, name);
}

}  // namespace bodyschema::gl
