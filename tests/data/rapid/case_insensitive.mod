module CaseInsensitive(SysModule)
  local pers Num A:=1;
  proc Main()
    If a=1 And Not b Then movel P1,V100,Z10,TGUN\wobj:=W; endif
    For I From 1 To 2 Do a:=i Div 2 mOd 3; EndFor
    b:=true;
  EndProc
endmodule
