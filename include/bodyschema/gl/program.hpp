#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "bodyschema/gl/functions.hpp"

namespace bodyschema::gl {

/// A linked shader program. Create, use and destroy it with its context current.
class Program {
 public:
  struct Stage {
    GLenum type;              ///< GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_COMPUTE_SHADER
    std::string_view source;  ///< with its #version line
  };
  /// Throws ContextError with `name` and the driver's log when a stage does not compile or link.
  Program(const Functions& gl, std::string_view name, std::initializer_list<Stage> stages);
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&&) = delete;

  void use() const;
  /// -1 for a uniform the compiler dropped, which OpenGL ignores.
  [[nodiscard]] GLint uniform(const char* name) const;

 private:
  const Functions* gl_;
  GLuint id_ = 0;
};

}  // namespace bodyschema::gl
