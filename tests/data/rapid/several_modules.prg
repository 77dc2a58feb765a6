%%%
VERSION:1
LANGUAGE:ENGLISH
%%%
MODULE One
  VAR num a;
ENDMODULE
 a footer that nobody reads; IF
! and a comment
%%%
VERSION:1
LANGUAGE:ENGLISH
%%%
MODULE Two (SYSMODULE)
  VAR num b;
ENDMODULE
