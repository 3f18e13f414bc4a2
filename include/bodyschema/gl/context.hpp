#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "bodyschema/core/error.hpp"

namespace bodyschema::gl {

struct Functions;

/// No OpenGL context can be had, or the driver refuses something it must be able to do. Names every
/// way that was tried and why it failed.
class ContextError : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// A headless OpenGL core context, 4.5 where the driver has it and at least 4.3.
///
/// Created current on no thread; hold a Current while calling OpenGL. One thread at a time.
class Context {
 public:
  /// @param platform  "egl_device" (a GPU if there is one, else a software device),
  ///   "egl_surfaceless", "osmesa", or "auto": these in order, with the default EGL display before
  ///   OSMesa. OSMesa is looked up when it is asked for, as libOSMesa.so.8, .6 or the path in the
  ///   environment variable BODYSCHEMA_OSMESA.
  /// Throws ContextError when there is no such context, std::invalid_argument for an unknown name.
  static std::unique_ptr<Context> create(std::string_view platform = "auto");

  virtual ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Makes the context current on this thread for as long as it lives.
  class Current {
   public:
    explicit Current(Context& context) : context_(context), ok_(context.make_current()) {}
    ~Current() { context_.release(); }
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;
    [[nodiscard]] bool ok() const { return ok_; }

   private:
    Context& context_;
    bool ok_;
  };

  /// Loaded entry points; valid while the context is current.
  [[nodiscard]] const Functions& functions() const { return *functions_; }
  /// Whether the processor does the drawing (llvmpipe, softpipe, ...).
  [[nodiscard]] bool is_software() const { return is_software_; }
  /// "EGL device".
  [[nodiscard]] const std::string& platform() const { return platform_; }
  /// The driver's GL_RENDERER.
  [[nodiscard]] const std::string& renderer() const { return renderer_; }
  /// "llvmpipe (EGL device, OpenGL 4.5)".
  [[nodiscard]] std::string description() const;

 protected:
  Context();
  virtual bool make_current() noexcept = 0;
  virtual void release() noexcept = 0;
  /// Loads the functions and reads renderer and version. Throws ContextError.
  void load(std::string platform, void (*(*get_function)(const char*))());

 private:
  std::unique_ptr<Functions> functions_;
  std::string platform_;
  std::string renderer_;
  int major_ = 0;
  int minor_ = 0;
  bool is_software_ = false;
};

}  // namespace bodyschema::gl
