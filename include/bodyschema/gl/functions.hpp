#pragma once

#include <GL/glcorearb.h>

namespace bodyschema::gl {

// Every OpenGL function the project calls, as (name without gl, type of its pointer).
#define BODYSCHEMA_GL_FUNCTIONS(X)                                           \
  X(ActiveTexture, PFNGLACTIVETEXTUREPROC)                                   \
  X(AttachShader, PFNGLATTACHSHADERPROC)                                     \
  X(BindBuffer, PFNGLBINDBUFFERPROC)                                         \
  X(BindBufferBase, PFNGLBINDBUFFERBASEPROC)                                 \
  X(BindFramebuffer, PFNGLBINDFRAMEBUFFERPROC)                               \
  X(BindRenderbuffer, PFNGLBINDRENDERBUFFERPROC)                             \
  X(BindTexture, PFNGLBINDTEXTUREPROC)                                       \
  X(BindVertexArray, PFNGLBINDVERTEXARRAYPROC)                               \
  X(BufferData, PFNGLBUFFERDATAPROC)                                         \
  X(BufferSubData, PFNGLBUFFERSUBDATAPROC)                                   \
  X(CheckFramebufferStatus, PFNGLCHECKFRAMEBUFFERSTATUSPROC)                 \
  X(Clear, PFNGLCLEARPROC)                                                   \
  X(ClearColor, PFNGLCLEARCOLORPROC)                                         \
  X(CompileShader, PFNGLCOMPILESHADERPROC)                                   \
  X(CreateProgram, PFNGLCREATEPROGRAMPROC)                                   \
  X(CreateShader, PFNGLCREATESHADERPROC)                                     \
  X(CullFace, PFNGLCULLFACEPROC)                                             \
  X(DeleteBuffers, PFNGLDELETEBUFFERSPROC)                                   \
  X(DeleteFramebuffers, PFNGLDELETEFRAMEBUFFERSPROC)                         \
  X(DeleteProgram, PFNGLDELETEPROGRAMPROC)                                   \
  X(DeleteRenderbuffers, PFNGLDELETERENDERBUFFERSPROC)                       \
  X(DeleteShader, PFNGLDELETESHADERPROC)                                     \
  X(DeleteTextures, PFNGLDELETETEXTURESPROC)                                 \
  X(DeleteVertexArrays, PFNGLDELETEVERTEXARRAYSPROC)                         \
  X(DepthFunc, PFNGLDEPTHFUNCPROC)                                           \
  X(Disable, PFNGLDISABLEPROC)                                               \
  X(DispatchCompute, PFNGLDISPATCHCOMPUTEPROC)                               \
  X(DrawArrays, PFNGLDRAWARRAYSPROC)                                         \
  X(DrawElements, PFNGLDRAWELEMENTSPROC)                                     \
  X(DrawElementsInstanced, PFNGLDRAWELEMENTSINSTANCEDPROC)                   \
  X(Enable, PFNGLENABLEPROC)                                                 \
  X(EnableVertexAttribArray, PFNGLENABLEVERTEXATTRIBARRAYPROC)               \
  X(Finish, PFNGLFINISHPROC)                                                 \
  X(FramebufferRenderbuffer, PFNGLFRAMEBUFFERRENDERBUFFERPROC)               \
  X(FramebufferTexture2D, PFNGLFRAMEBUFFERTEXTURE2DPROC)                     \
  X(FrontFace, PFNGLFRONTFACEPROC)                                           \
  X(GenBuffers, PFNGLGENBUFFERSPROC)                                         \
  X(GenFramebuffers, PFNGLGENFRAMEBUFFERSPROC)                               \
  X(GenRenderbuffers, PFNGLGENRENDERBUFFERSPROC)                             \
  X(GenTextures, PFNGLGENTEXTURESPROC)                                       \
  X(GenVertexArrays, PFNGLGENVERTEXARRAYSPROC)                               \
  X(GetBufferSubData, PFNGLGETBUFFERSUBDATAPROC)                             \
  X(GetError, PFNGLGETERRORPROC)                                             \
  X(GetIntegerv, PFNGLGETINTEGERVPROC)                                       \
  X(GetProgramInfoLog, PFNGLGETPROGRAMINFOLOGPROC)                           \
  X(GetProgramiv, PFNGLGETPROGRAMIVPROC)                                     \
  X(GetShaderInfoLog, PFNGLGETSHADERINFOLOGPROC)                             \
  X(GetShaderiv, PFNGLGETSHADERIVPROC)                                       \
  X(GetString, PFNGLGETSTRINGPROC)                                           \
  X(GetUniformLocation, PFNGLGETUNIFORMLOCATIONPROC)                         \
  X(LinkProgram, PFNGLLINKPROGRAMPROC)                                       \
  X(MemoryBarrier, PFNGLMEMORYBARRIERPROC)                                   \
  X(PixelStorei, PFNGLPIXELSTOREIPROC)                                       \
  X(ReadPixels, PFNGLREADPIXELSPROC)                                         \
  X(RenderbufferStorage, PFNGLRENDERBUFFERSTORAGEPROC)                       \
  X(RenderbufferStorageMultisample, PFNGLRENDERBUFFERSTORAGEMULTISAMPLEPROC) \
  X(BlitFramebuffer, PFNGLBLITFRAMEBUFFERPROC)                               \
  X(Scissor, PFNGLSCISSORPROC)                                               \
  X(ShaderSource, PFNGLSHADERSOURCEPROC)                                     \
  X(TexBuffer, PFNGLTEXBUFFERPROC)                                           \
  X(TexParameteri, PFNGLTEXPARAMETERIPROC)                                   \
  X(TexStorage2D, PFNGLTEXSTORAGE2DPROC)                                     \
  X(TexSubImage2D, PFNGLTEXSUBIMAGE2DPROC)                                   \
  X(Uniform1i, PFNGLUNIFORM1IPROC)                                           \
  X(Uniform1f, PFNGLUNIFORM1FPROC)                                           \
  X(Uniform2f, PFNGLUNIFORM2FPROC)                                           \
  X(Uniform3f, PFNGLUNIFORM3FPROC)                                           \
  X(Uniform4f, PFNGLUNIFORM4FPROC)                                           \
  X(Uniform2iv, PFNGLUNIFORM2IVPROC)                                         \
  X(UniformMatrix3fv, PFNGLUNIFORMMATRIX3FVPROC)                             \
  X(UniformMatrix4fv, PFNGLUNIFORMMATRIX4FVPROC)                             \
  X(UseProgram, PFNGLUSEPROGRAMPROC)                                         \
  X(VertexAttribIPointer, PFNGLVERTEXATTRIBIPOINTERPROC)                     \
  X(VertexAttribPointer, PFNGLVERTEXATTRIBPOINTERPROC)                       \
  X(Viewport, PFNGLVIEWPORTPROC)

/// Pointers to the entry points, named as in OpenGL without the prefix: `gl.DrawArrays(...)`.
/// Loaded by Context through eglGetProcAddress or OSMesaGetProcAddress, so no GL library is linked.
struct Functions {
#define BODYSCHEMA_GL_MEMBER(name, type) type name = nullptr;
  BODYSCHEMA_GL_FUNCTIONS(BODYSCHEMA_GL_MEMBER)
#undef BODYSCHEMA_GL_MEMBER
};

}  // namespace bodyschema::gl
