MODULE LateBinding
  PROC main()
    %"rPart"+ValToStr(n)%;
    %name% 1,\Fast;
    %"weld_"+part%
      p1,v100;
    CallByVar "proc",n;
  ENDPROC
ENDMODULE
